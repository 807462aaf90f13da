//! The linear fit (paper, equation 5) without its 12×12 decomposition.
//!
//! With m = (x, y, 1, d), u·(h₃·m) = h₁·m and v·(h₃·m) = h₂·m are a camera resectioning. For a fixed third row h₃ the
//! best h₁ = S⁻¹S_u h₃ and h₂ = S⁻¹S_v h₃, with the moments S = Σmmᵀ, S_u = Σu·mmᵀ, S_v = Σv·mmᵀ. What is left is the
//! smallest eigenvector of the 4×4 matrix Σ(u²+v²)mmᵀ − S_uS⁻¹S_u − S_vS⁻¹S_v. The homography is the same without d.
//! The sign of the result is arbitrary.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::points::{Points, Projection};

pub(super) type Square<const D: usize> = [[f64; D]; D];

/// Fits a projection to the matches `indices`: D = 4 with depth (6 matches or more), D = 3 a homography (4 or more).
///
/// `None` when the matches do not determine it: a coordinate that the ones before explain but for the share
/// `min_pivot` of its variance means that they lie on one line or in one spot (y), or on one plane of depth (d).
#[inline(never)]
pub(super) fn fit<const D: usize>(points: &Points, indices: &[usize], min_pivot: f64) -> Option<Projection> {
    // In the order 1, x, y, d, so that each pivot is the variance that the coordinates before leave unexplained.
    let (mut s, mut su, mut sv, mut q) = ([[0.0; D]; D], [[0.0; D]; D], [[0.0; D]; D], [[0.0; D]; D]);
    for &i in indices {
        let m = [1.0, points.x[i], points.y[i], points.d[i]];
        let (u, v) = (points.u[i], points.v[i]);
        let square = u * u + v * v;
        for r in 0..D {
            for c in 0..=r {
                let mm = m[r] * m[c];
                s[r][c] += mm;
                su[r][c] += u * mm;
                sv[r][c] += v * mm;
                q[r][c] += square * mm;
            }
        }
    }
    let n = s[0][0];
    for a in [&mut su, &mut sv, &mut q] {
        for r in 0..D {
            for c in 0..r {
                a[c][r] = a[r][c];
            }
        }
    }
    cholesky(&mut s, min_pivot * n)?;
    let (wu, wv) = (forward(&s, su), forward(&s, sv));
    for r in 0..D {
        for c in 0..D {
            for k in 0..D {
                q[r][c] -= wu[k][r] * wu[k][c] + wv[k][r] * wv[k][c];
            }
        }
    }
    let h3 = smallest_eigenvector(q);
    let row = |w: &Square<D>| backward(&s, std::array::from_fn(|r| (0..D).map(|c| w[r][c] * h3[c]).sum()));
    let order = |h: [f64; D]| [h[1], h[2], h[0], if D > 3 { h[3] } else { 0.0 }];
    Some([order(row(&wu)), order(row(&wv)), order(h3)])
}

/// Replaces the lower triangle of `a` by its Cholesky factor; `None` when a pivot is below `min_pivot`.
pub(super) fn cholesky<const D: usize>(a: &mut Square<D>, min_pivot: f64) -> Option<()> {
    for j in 0..D {
        let pivot = a[j][j] - (0..j).map(|k| a[j][k] * a[j][k]).sum::<f64>();
        if pivot.is_nan() || pivot <= min_pivot {
            return None;
        }
        a[j][j] = pivot.sqrt();
        for r in j + 1..D {
            let dot: f64 = (0..j).map(|k| a[r][k] * a[j][k]).sum();
            a[r][j] = (a[r][j] - dot) / a[j][j];
        }
    }
    Some(())
}

/// L⁻¹b, column by column.
fn forward<const D: usize>(l: &Square<D>, mut b: Square<D>) -> Square<D> {
    for r in 0..D {
        for c in 0..D {
            let dot: f64 = (0..r).map(|k| l[r][k] * b[k][c]).sum();
            b[r][c] = (b[r][c] - dot) / l[r][r];
        }
    }
    b
}

/// L⁻ᵀb.
pub(super) fn backward<const D: usize>(l: &Square<D>, mut b: [f64; D]) -> [f64; D] {
    for r in (0..D).rev() {
        let dot: f64 = (r + 1..D).map(|k| l[k][r] * b[k]).sum();
        b[r] = (b[r] - dot) / l[r][r];
    }
    b
}

/// Eigenvector of the smallest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations.
fn smallest_eigenvector<const D: usize>(mut a: Square<D>) -> [f64; D] {
    let mut vectors: Square<D> = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
    let trace: f64 = (0..D).map(|i| a[i][i].abs()).sum();
    for _ in 0..12 {
        let mut off = 0.0;
        for p in 0..D {
            for q in p + 1..D {
                off += a[p][q] * a[p][q];
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = if theta < 0.0 { -1.0 } else { 1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..D {
                    (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
                }
                for k in 0..D {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                    (vectors[k][p], vectors[k][q]) =
                        (c * vectors[k][p] - s * vectors[k][q], s * vectors[k][p] + c * vectors[k][q]);
                }
            }
        }
        if off <= 1e-30 * trace * trace {
            break;
        }
    }
    let mut least = 0;
    for i in 1..D {
        if a[i][i] < a[least][least] {
            least = i;
        }
    }
    vectors.map(|row| row[least])
}
