//! The fundamental matrix and the distance of a match from it.

use crate::geometry::errors::Errors;
use crate::geometry::points::Point;

/// Takes a point of the target to its epipolar line in the reference, u·F·x = 0; row by row.
pub(super) type Fundamental = [[f64; 3]; 3];

pub(super) type Vector = [f64; 3];

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// M·v.
pub(super) fn apply(m: &[Vector; 3], v: Vector) -> Vector {
    m.map(|row| dot(row, v))
}

/// Mᵀ·v.
pub(super) fn apply_transposed(m: &[Vector; 3], v: Vector) -> Vector {
    [0, 1, 2].map(|c| m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2])
}

/// The cofactors of F, which are also the gradient of its determinant. When F has rank 2 every row is a multiple of the
/// epipole in the target and every column of the one in the reference.
pub(super) fn cofactors(f: &Fundamental) -> Fundamental {
    [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])]
}

/// The epipole in the reference, of length 1; `None` when F has not rank 2.
pub(super) fn epipole(f: &Fundamental) -> Option<Vector> {
    let c = cofactors(f);
    let columns = [0, 1, 2].map(|k| [c[0][k], c[1][k], c[2][k]]);
    let mut longest = columns[0];
    for column in columns {
        if dot(column, column) > dot(longest, longest) {
            longest = column;
        }
    }
    let length = dot(longest, longest).sqrt();
    (length > 0.0 && length.is_finite()).then(|| longest.map(|v| v / length))
}

/// [e]×·M.
pub(super) fn cross_matrix(e: Vector, m: &[Vector; 3]) -> Fundamental {
    let columns = [0, 1, 2].map(|k| cross(e, [m[0][k], m[1][k], m[2][k]]));
    [0, 1, 2].map(|r| [columns[0][r], columns[1][r], columns[2][r]])
}

/// Sampson distances: to first order how far both points together must move to meet the constraint.
impl Errors for Fundamental {
    #[inline(always)]
    fn error(&self, p: &Point) -> f64 {
        let (m, n) = ([p.x, p.y, 1.0], [p.u, p.v, 1.0]);
        let ([a, b, c], [d, e, _]) = (apply(self, m), apply_transposed(self, n));
        let s = a * p.u + b * p.v + c;
        s * s / (a * a + b * b + d * d + e * e)
    }
}
