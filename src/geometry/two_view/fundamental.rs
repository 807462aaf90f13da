//! The fundamental matrix and the distance of a match from it.

use crate::geometry::points::{Points, Scales};

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

/// Squared Sampson distances: to first order how far both points together must move to meet the constraint.
pub(super) fn sampson<'a>(points: &'a Points, f: &'a Fundamental) -> impl Iterator<Item = f64> + 'a {
    (0..points.len()).map(move |i| squared_distance(f, points.x[i], points.y[i], points.u[i], points.v[i]))
}

#[inline(always)]
fn squared_distance(f: &Fundamental, x: f64, y: f64, u: f64, v: f64) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|r| f[r][0] * x + f[r][1] * y + f[r][2]);
    let [p, q] = [0, 1].map(|k| f[0][k] * u + f[1][k] * v + f[2][k]);
    let s = a * u + b * v + c;
    s * s / (a * a + b * b + p * p + q * q)
}

/// Which matches are within the threshold.
pub(super) fn inliers_of(points: &Points, f: &Fundamental, threshold: f64) -> Vec<bool> {
    sampson(points, f).map(|e| e < threshold * threshold).collect()
}

/// Cost of F over all scales, as that of a projection. Stops once it reaches `limit`.
pub(super) fn cost(points: &Points, f: &Fundamental, scales: &Scales, limit: f64) -> f64 {
    const BLOCK: usize = 64;
    let inverse = scales.0.map(|t| 1.0 / (t * t));
    let mut cost = 0.0;
    let mut start = 0;
    while start < points.len() && cost < limit {
        let end = (start + BLOCK).min(points.len());
        let (x, y) = (&points.x[start..end], &points.y[start..end]);
        let (u, v) = (&points.u[start..end], &points.v[start..end]);
        for i in 0..end - start {
            let error = squared_distance(f, x[i], y[i], u[i], v[i]);
            for scale in inverse {
                let share = error * scale;
                cost += if share < 1.0 { share } else { 1.0 };
            }
        }
        start = end;
    }
    cost
}
