//! The fundamental matrices through seven matches (Hartley & Zisserman, section 11.1.2).

use nalgebra::{FullPivLU, Matrix3, SMatrix, SVector};

use super::fundamental::{Fundamental, cofactors};
use crate::geometry::correspondences::{Correspondence, Correspondences};

/// Matches in a minimal sample.
pub(super) const SAMPLE: usize = 7;

/// Below this fraction of the first pivot a pivot counts as rounding.
const MIN_PIVOT: f64 = 1e-10;
/// Bisections of a root; each gains a bit.
const BISECTIONS: usize = 60;

/// Up to three matrices of rank 2; none if the matches leave more than two dimensions open.
pub(super) fn seven_point(points: &Correspondences, sample: &[usize]) -> Vec<Fundamental> {
    let mut rows = SMatrix::<f64, SAMPLE, 9>::zeros();
    for (r, &i) in sample.iter().enumerate().take(SAMPLE) {
        let Correspondence { x, y, u, v, .. } = points[i];
        rows.set_row(r, &SVector::from([u * x, u * y, u, v * x, v * y, v, x, y, 1.0]).transpose());
    }
    let Some([a, b]) = null_space(rows) else { return Vec::new() };
    real_roots(determinant(&a, &b)).into_iter().map(|t| Fundamental(a + b * t)).collect()
}

/// det(A + tB) as a polynomial, constant first.
fn determinant(a: &Matrix3<f64>, b: &Matrix3<f64>) -> [f64; 4] {
    [a.determinant(), cofactors(a).dot(b), cofactors(b).dot(a), b.determinant()]
}

/// Two matrices, read row by row, that span what is orthogonal to all rows.
fn null_space(rows: SMatrix<f64, SAMPLE, 9>) -> Option<[Matrix3<f64>; 2]> {
    let lu = FullPivLU::new(rows);
    let u = lu.u();
    if !(0..SAMPLE).all(|i| u[(i, i)].abs() > MIN_PIVOT * u[(0, 0)].abs()) {
        return None;
    }
    // With the columns permuted, (U₁ U₂)·(x, f) = 0 for any choice of the last two entries f.
    let bound = u.fixed_columns::<SAMPLE>(0).solve_upper_triangular(&-u.fixed_columns::<2>(SAMPLE))?;
    let mut basis = SMatrix::<f64, 9, 2>::zeros();
    basis.fixed_rows_mut::<SAMPLE>(0).copy_from(&bound);
    basis.fixed_rows_mut::<2>(SAMPLE).fill_with_identity();
    lu.q().inv_permute_rows(&mut basis);
    Some([0, 1].map(|i| Matrix3::from_row_iterator(basis.column(i).iter().copied())))
}

/// The real roots of a cubic, constant first, by bisection between its extrema.
fn real_roots([d, c, b, a]: [f64; 4]) -> Vec<f64> {
    let mut roots = Vec::new();
    let value = |t: f64| ((a * t + b) * t + c) * t + d;
    // Cauchy's bound.
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
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (value(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        roots.push(0.5 * (low + high));
    }
    roots
}
