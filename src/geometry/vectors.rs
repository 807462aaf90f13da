//! Vectors, 3×3 matrices and rows of numbers. Little of it is hot, and calls take less room than copies.

pub(super) type Vector = [f64; 3];
/// Row by row.
pub(super) type Matrix = [Vector; 3];

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(never)]
pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + k·b.
pub(super) fn added(a: Vector, b: Vector, k: f64) -> Vector {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}

/// M·v.
#[inline(never)]
pub(super) fn apply(m: &Matrix, v: Vector) -> Vector {
    m.map(|row| dot(row, v))
}

#[inline(never)]
pub(super) fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| m.map(|row| row[i]))
}

/// The cofactors of M: its inverse transposed, times its determinant, whose gradient they are.
#[inline(never)]
pub(super) fn cofactors(m: &Matrix) -> Matrix {
    [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])]
}

/// a + k·b in place of a.
#[inline(never)]
pub(super) fn add(a: &mut [f64], k: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += k * b);
}

/// k·a in place of a.
#[inline(never)]
pub(super) fn scale(a: &mut [f64], k: f64) {
    a.iter_mut().for_each(|a| *a *= k);
}

/// Σab.
#[inline(never)]
pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
