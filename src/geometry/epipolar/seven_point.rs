//! The fundamental matrices through seven matches (Hartley & Zisserman, section 11.1.2).

use super::fundamental::Fundamental;
use crate::geometry::points::{Point, Points};
use crate::geometry::vectors::{add, cofactors, product, scale};

pub(super) const SAMPLE: usize = 7;

/// Up to three matrices of rank 2; none when the matches leave more than two dimensions open.
#[inline(never)]
pub(super) fn seven_point(points: &Points, sample: [usize; SAMPLE]) -> Vec<Fundamental> {
    let mut rows = [[0.0; 9]; SAMPLE];
    for (row, i) in rows.iter_mut().zip(sample) {
        let Point { x, y, u, v, .. } = points[i];
        *row = [u * x, u * y, u, v * x, v * y, v, x, y, 1.0];
    }
    let mut found = Vec::new();
    if let Some([a, b]) = null_space(rows) {
        for t in real_roots(determinant(&a, &b)) {
            // A + tB.
            let mut f = a;
            add(f.as_flattened_mut(), t, b.as_flattened());
            found.push(f);
        }
    }
    found
}

/// det(A + tB) as a polynomial, the constant first.
fn determinant(a: &Fundamental, b: &Fundamental) -> [f64; 4] {
    let product = |a: &Fundamental, b: &Fundamental| product(a.as_flattened(), b.as_flattened());
    let (ca, cb) = (cofactors(a), cofactors(b));
    [product(&ca, a) / 3.0, product(&ca, b), product(&cb, a), product(&cb, b) / 3.0]
}

/// Two matrices that span what is orthogonal to all rows, by Gauss–Jordan elimination with full pivoting.
#[inline(never)]
fn null_space(mut rows: [[f64; 9]; SAMPLE]) -> Option<[Fundamental; 2]> {
    // The column of each row's pivot. All other rows are 0 there, so that none has two.
    let mut pivots = [0; SAMPLE];
    let mut first = 0.0;
    for k in 0..SAMPLE {
        let (mut at, mut largest) = (9 * k, 0.0);
        for (i, v) in rows.as_flattened().iter().enumerate().skip(9 * k) {
            if v.abs() > largest {
                (at, largest) = (i, v.abs());
            }
        }
        first = if k == 0 { largest } else { first };
        if largest.is_nan() || largest <= 1e-10 * first {
            return None;
        }
        pivots[k] = at % 9;
        let mut pivot = rows[at / 9];
        rows[at / 9] = rows[k];
        let largest = pivot[pivots[k]];
        scale(&mut pivot, 1.0 / largest);
        // Exactly, so that it vanishes from the others.
        pivot[pivots[k]] = 1.0;
        for row in &mut rows {
            let factor = row[pivots[k]];
            add(row, -factor, &pivot);
        }
        rows[k] = pivot;
    }
    let mut basis = [[[0.0; 3]; 3]; 2];
    let free = (0..9).filter(|c| !pivots.contains(c));
    for (vector, free) in basis.iter_mut().zip(free) {
        let vector = vector.as_flattened_mut();
        vector[free] = 1.0;
        for (row, pivot) in rows.iter().zip(pivots) {
            vector[pivot] = -row[free];
        }
    }
    Some(basis)
}

/// The real roots of a cubic, constant first, by bisection between its extrema.
#[inline(never)]
fn real_roots([d, c, b, a]: [f64; 4]) -> Vec<f64> {
    let mut roots = Vec::new();
    let value = |t: f64| ((a * t + b) * t + c) * t + d;
    let bound = 1.0 + (b.abs().max(c.abs()).max(d.abs()) / a.abs());
    if !bound.is_finite() {
        return roots;
    }
    let root = (b * b - 3.0 * a * c).max(0.0).sqrt();
    let [one, other] = [-b - root, -b + root].map(|numerator| numerator / (3.0 * a));
    for ends in [-bound, one.min(other), one.max(other), bound].windows(2) {
        let [mut low, mut high] = [ends[0], ends[1]];
        let rising = value(low) < 0.0;
        if rising == (value(high) < 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (value(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        roots.push(0.5 * (low + high));
    }
    roots
}
