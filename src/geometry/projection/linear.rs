//! The linear fit (paper, equations 6 to 8) without its 12×12 decomposition.
//!
//! With m = (1, x, y, d), u·(h₃·m) = h₁·m and v·(h₃·m) = h₂·m are a camera resectioning. For a fixed third row h₃ the
//! best h₁ = S⁻¹S_u h₃ and h₂ = S⁻¹S_v h₃, with the moments S = Σmmᵀ, S_u = Σu·mmᵀ, S_v = Σv·mmᵀ. What is left is the
//! smallest eigenvector of the 4×4 matrix Σ(u²+v²)mmᵀ − S_uS⁻¹S_u − S_vS⁻¹S_v. The homography is the same without d.

use nalgebra::{SMatrix, SVector};

use crate::geometry::correspondences::{Correspondence, Correspondences, ProjectionMatrix};
use crate::geometry::eigen::eigenpairs;

/// Fits a projection of N columns to the matches `indices`: 4 with depth (6 matches or more), 3 a homography (4 or more).
/// The sign of the result is arbitrary.
///
/// `None` if the matches do not determine it. In the order 1, x, y, d each pivot of S is the variance that the coordinates
/// before leave unexplained: below the fraction `min_pivot`, the matches lie on one line or in one spot (y), or on one
/// plane of depth (d).
pub(super) fn fit<const N: usize>(
    points: &Correspondences,
    indices: &[usize],
    min_pivot: f64,
) -> Option<ProjectionMatrix> {
    let [mut s, mut su, mut sv, mut q] = [SMatrix::<f64, N, N>::zeros(); 4];
    for &i in indices {
        let Correspondence { x, y, d, u, v } = points[i];
        let m = SVector::<f64, N>::from_column_slice(&[1.0, x, y, d][..N]);
        let mm = m * m.transpose();
        s += mm;
        su += mm * u;
        sv += mm * v;
        q += mm * (u * u + v * v);
    }
    let least = min_pivot * s[(0, 0)];
    let l = s.cholesky()?.l();
    if !l.diagonal().iter().all(|pivot| pivot * pivot > least) {
        return None;
    }
    let (wu, wv) = (l.solve_lower_triangular(&su)?, l.solve_lower_triangular(&sv)?);
    q -= wu.tr_mul(&wu) + wv.tr_mul(&wv);
    let h3 = eigenpairs(&q)?[N - 1].1;
    let (h1, h2) = (l.tr_solve_lower_triangular(&(wu * h3))?, l.tr_solve_lower_triangular(&(wv * h3))?);
    // From 1, x, y, d to x, y, 1, d.
    const ORDER: [usize; 4] = [1, 2, 0, 3];
    let rows = [h1, h2, h3];
    Some(ProjectionMatrix::from_fn(|r, c| rows[r].get(ORDER[c]).copied().unwrap_or(0.0)))
}
