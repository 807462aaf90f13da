//! The linear fit (paper, equation 5) without its 12×12 decomposition.
//!
//! With m = (x, y, 1, d), u·(h₃·m) = h₁·m and v·(h₃·m) = h₂·m are a camera resectioning. For a fixed third row h₃ the
//! best h₁ = S⁻¹S_u h₃ and h₂ = S⁻¹S_v h₃, with the moments S = Σmmᵀ, S_u = Σu·mmᵀ, S_v = Σv·mmᵀ. What is left is the
//! smallest eigenvector of the 4×4 matrix Σ(u²+v²)mmᵀ − S_uS⁻¹S_u − S_vS⁻¹S_v. The homography is the same without d.
//! The sign of the result is arbitrary.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::points::{Point, Points, Projection};

/// The most columns a projection has.
const MOST: usize = 4;

/// Fits a projection of `columns` to the matches `indices`: 4 with depth (6 matches or more), 3 a homography (4 or more).
///
/// `None` when the matches do not determine it: a coordinate that the ones before explain but for the share
/// `min_pivot` of its variance means that they lie on one line or in one spot (y), or on one plane of depth (d).
#[inline(never)]
pub(super) fn fit(points: &Points, indices: &[usize], columns: usize, min_pivot: f64) -> Option<Projection> {
    let n = columns.min(MOST);
    // S, S_u, S_v and Σ(u²+v²)mmᵀ in the order 1, x, y, d, so that each pivot is the variance that the coordinates before
    // leave unexplained.
    let mut moments = [[0.0; MOST * MOST]; 4];
    for &i in indices {
        let Point { x, y, d, u, v } = points[i];
        let m = [1.0, x, y, d];
        let weights = [1.0, u, v, u * u + v * v];
        for r in 0..n {
            for c in 0..n {
                let mm = m[r] * m[c];
                for (moment, weight) in moments.iter_mut().zip(weights) {
                    moment[r * n + c] += weight * mm;
                }
            }
        }
    }
    let [s, su, sv, q] = &mut moments;
    let matches = s[0];
    cholesky(s, n, min_pivot * matches)?;
    // The rows of these symmetric matrices become the columns of L⁻¹S_u and L⁻¹S_v.
    for row in su.chunks_exact_mut(n).zip(sv.chunks_exact_mut(n)).take(n) {
        forward(s, row.0);
        forward(s, row.1);
    }
    for r in 0..n {
        for c in 0..n {
            for k in 0..n {
                q[r * n + c] -= su[r * n + k] * su[c * n + k] + sv[r * n + k] * sv[c * n + k];
            }
        }
    }
    let mut rows = [[0.0; MOST]; 3];
    rows[2] = smallest_eigenvector(q, n);
    for (w, i) in [(su, 0), (sv, 1)] {
        for r in 0..n {
            rows[i][r] = (0..n).map(|c| w[c * n + r] * rows[2][c]).sum();
        }
        backward(s, &mut rows[i][..n]);
    }
    Some(rows.map(|h| [h[1], h[2], h[0], h[3]]))
}

/// Replaces the lower triangle of the n×n matrix `a` by its Cholesky factor; `None` when a pivot is at most `min_pivot`.
#[inline(never)]
fn cholesky(a: &mut [f64], n: usize, min_pivot: f64) -> Option<()> {
    for j in 0..n {
        for r in j..n {
            let dot: f64 = (0..j).map(|k| a[r * n + k] * a[j * n + k]).sum();
            let rest = a[r * n + j] - dot;
            if r > j {
                a[r * n + j] = rest / a[j * n + j];
            } else if rest > min_pivot {
                a[r * n + j] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(())
}

/// A⁻¹b in place of b, A being the symmetric matrix in the lower triangle of `a`, which becomes its Cholesky factor; `None`
/// when A is not positive definite.
pub(super) fn solve(a: &mut [f64], b: &mut [f64]) -> Option<()> {
    cholesky(a, b.len(), 0.0)?;
    forward(a, b);
    backward(a, b);
    Some(())
}

/// L⁻¹b in place of b, L being the lower triangle of `l`.
#[inline(never)]
fn forward(l: &[f64], b: &mut [f64]) {
    let n = b.len();
    for r in 0..n {
        let dot: f64 = (0..r).map(|k| l[r * n + k] * b[k]).sum();
        b[r] = (b[r] - dot) / l[r * n + r];
    }
}

/// L⁻ᵀb in place of b.
#[inline(never)]
fn backward(l: &[f64], b: &mut [f64]) {
    let n = b.len();
    for r in (0..n).rev() {
        let dot: f64 = (r + 1..n).map(|k| l[k * n + r] * b[k]).sum();
        b[r] = (b[r] - dot) / l[r * n + r];
    }
}

/// Eigenvector of the smallest eigenvalue of a symmetric n×n matrix, by cyclic Jacobi rotations.
fn smallest_eigenvector(a: &mut [f64], n: usize) -> [f64; MOST] {
    let mut vectors = [0.0; MOST * MOST];
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    let trace: f64 = (0..n).map(|i| a[i * n + i].abs()).sum();
    for _ in 0..12 {
        let mut off = 0.0;
        for p in 0..n {
            for q in p + 1..n {
                let (at, pp, qq) = (a[p * n + q], a[p * n + p], a[q * n + q]);
                off += at * at;
                if at == 0.0 {
                    continue;
                }
                let theta = (qq - pp) / (2.0 * at);
                let t = if theta < 0.0 { -1.0 } else { 1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                // Columns of both, then rows.
                let turn = [c, t * c];
                rotate(a, n, [p, q], n, turn);
                rotate(a, n, [p * n, q * n], 1, turn);
                rotate(&mut vectors, n, [p, q], n, turn);
            }
        }
        if off <= 1e-30 * trace * trace {
            break;
        }
    }
    let mut least = 0;
    for i in 1..n {
        if a[i * n + i] < a[least * n + least] {
            least = i;
        }
    }
    let mut vector = [0.0; MOST];
    (0..n).for_each(|i| vector[i] = vectors[i * n + least]);
    vector
}

/// Rotates two rows or columns of `n` entries, `step` apart from the places `p` and `q` on, by an angle given as cosine
/// and sine.
#[inline(never)]
fn rotate(a: &mut [f64], n: usize, [p, q]: [usize; 2], step: usize, [c, s]: [f64; 2]) {
    for k in 0..n {
        let (i, j) = (p + k * step, q + k * step);
        (a[i], a[j]) = (c * a[i] - s * a[j], s * a[i] + c * a[j]);
    }
}
