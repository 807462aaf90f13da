//! The fundamental matrices through seven matches (Hartley & Zisserman, section 11.1.2).

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::fundamental::{Fundamental, cofactors, dot};
use crate::geometry::points::{Point, Points};

pub(super) const SAMPLE: usize = 7;

/// Up to three matrices of rank 2; none when the matches leave more than two dimensions open.
pub(super) fn seven_point(points: &Points, sample: [usize; SAMPLE]) -> impl Iterator<Item = Fundamental> {
    let rows = sample.map(|i| {
        let Point { x, y, u, v, .. } = points[i];
        [u * x, u * y, u, v * x, v * y, v, x, y, 1.0]
    });
    let (mut matrices, mut roots) = ([[[0.0; 3]; 3]; 2], [None; 3]);
    if let Some(basis) = null_space(rows) {
        matrices = basis.map(|f| [[f[0], f[1], f[2]], [f[3], f[4], f[5]], [f[6], f[7], f[8]]]);
        roots = real_roots(determinant(&matrices));
    }
    roots.into_iter().flatten().map(move |t| combine(&matrices, t))
}

/// A + tB.
fn combine([a, b]: &[Fundamental; 2], t: f64) -> Fundamental {
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| a[r][c] + t * b[r][c]))
}

/// det(A + tB) as a polynomial, the constant first.
fn determinant([a, b]: &[Fundamental; 2]) -> [f64; 4] {
    let product = |a: &Fundamental, b: &Fundamental| (0..3).map(|r| dot(a[r], b[r])).sum::<f64>();
    let (ca, cb) = (cofactors(a), cofactors(b));
    [product(&ca, a) / 3.0, product(&ca, b), product(&cb, a), product(&cb, b) / 3.0]
}

/// Two vectors that span what is orthogonal to all rows, by Gauss–Jordan elimination with full pivoting.
fn null_space(mut m: [[f64; 9]; SAMPLE]) -> Option<[[f64; 9]; 2]> {
    let mut order: [usize; 9] = std::array::from_fn(|i| i);
    let mut first = 0.0;
    for k in 0..SAMPLE {
        let (mut row, mut column, mut pivot) = (k, k, 0.0);
        for r in k..SAMPLE {
            for c in k..9 {
                if m[r][order[c]].abs() > pivot {
                    (row, column, pivot) = (r, c, m[r][order[c]].abs());
                }
            }
        }
        first = if k == 0 { pivot } else { first };
        if pivot.is_nan() || pivot <= 1e-10 * first {
            return None;
        }
        m.swap(k, row);
        order.swap(k, column);
        let at = order[k];
        m[k] = m[k].map(|v| v / m[k][at]);
        for r in 0..SAMPLE {
            if r != k {
                let factor = m[r][at];
                for c in 0..9 {
                    m[r][c] -= factor * m[k][c];
                }
            }
        }
    }
    Some([7, 8].map(|free| {
        let mut vector = [0.0; 9];
        vector[order[free]] = 1.0;
        for k in 0..SAMPLE {
            vector[order[k]] = -m[k][order[free]];
        }
        vector
    }))
}

/// The real roots of a cubic, constant first, by bisection between its extrema.
fn real_roots([d, c, b, a]: [f64; 4]) -> [Option<f64>; 3] {
    let value = |t: f64| ((a * t + b) * t + c) * t + d;
    let bound = 1.0 + (b.abs().max(c.abs()).max(d.abs()) / a.abs());
    if !bound.is_finite() {
        return [None; 3];
    }
    let root = (b * b - 3.0 * a * c).max(0.0).sqrt();
    let [one, other] = [-b - root, -b + root].map(|numerator| numerator / (3.0 * a));
    let ends = [-bound, one.min(other), one.max(other), bound];
    [0, 1, 2].map(|i| {
        let (mut low, mut high) = (ends[i], ends[i + 1]);
        let rising = value(low) < 0.0;
        if rising == (value(high) < 0.0) {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (value(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    })
}
