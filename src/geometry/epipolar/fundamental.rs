//! The fundamental matrix and the distance of a match from it.

use crate::geometry::errors::Errors;
use crate::geometry::points::Point;
use crate::geometry::vectors::{Matrix, Vector, cofactors, cross, dot, transposed};

/// Takes a point of the target to its epipolar line in the reference, u·F·x = 0; row by row. When it has rank 2 every row of
/// its cofactors is a multiple of the epipole in the target and every column of the one in the reference.
pub(super) type Fundamental = Matrix;

/// The epipole in the reference, of length 1; `None` when F has not rank 2.
#[inline(never)]
pub(super) fn epipole(f: &Fundamental) -> Option<Vector> {
    let columns = transposed(&cofactors(f));
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
#[inline(never)]
pub(super) fn cross_matrix(e: Vector, m: &Matrix) -> Fundamental {
    transposed(&transposed(m).map(|column| cross(e, column)))
}

/// Sampson distances: to first order how far both points together must move to meet the constraint.
impl Errors for Fundamental {
    #[inline(always)]
    fn error(&self, p: &Point) -> f64 {
        let there = |r: usize| self[r][0] * p.x + self[r][1] * p.y + self[r][2];
        let here = |c: usize| self[0][c] * p.u + self[1][c] * p.v + self[2][c];
        let (a, b, c, d, e) = (there(0), there(1), there(2), here(0), here(1));
        let s = a * p.u + b * p.v + c;
        s * s / (a * a + b * b + d * d + e * e)
    }
}
