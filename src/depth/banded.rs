//! Cholesky factorisation of symmetric positive definite band matrices.

use wide::f64x4;

use crate::Result;
use crate::image::zeroed;

/// The lower triangle of a symmetric matrix whose entries farther than `bandwidth` from the diagonal are 0.
#[derive(Clone)]
pub(super) struct Banded {
    bandwidth: usize,
    /// Row by row, columns i − bandwidth to i.
    rows: Vec<f64>,
}

impl Banded {
    pub fn new(size: usize, bandwidth: usize) -> Result<Self> {
        Ok(Self { bandwidth, rows: zeroed(size * (bandwidth + 1))? })
    }

    /// Adds to the entries (i, j) and (j, i); those outside the band are not there.
    #[inline(always)]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = (i.max(j), i.min(j));
        if i - j <= self.bandwidth
            && let Some(entry) = self.rows.get_mut(i * (self.bandwidth + 1) + self.bandwidth + j - i)
        {
            *entry += value;
        }
    }

    /// The product with a vector.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let b = self.bandwidth;
        let mut out = vec![0.0; x.len()];
        for (i, row) in self.rows.chunks_exact(b + 1).enumerate() {
            let first = b.saturating_sub(i);
            let from = i + first - b;
            let below = &row[first..b];
            out[i] += row[b] * x[i] + dot(below, &x[from..i]);
            add_scaled(&mut out[from..i], below, x[i]);
        }
        out
    }

    /// Replaces the matrix A by L of A = LLᵀ; `None` when it is not positive definite.
    pub fn cholesky(mut self) -> Option<Factor> {
        let b = self.bandwidth;
        for i in 0..self.rows.len() / (b + 1) {
            let (above, rest) = self.rows.split_at_mut(i * (b + 1));
            let row = &mut rest[..=b];
            for j in i.saturating_sub(b)..i {
                let other = &above[j * (b + 1)..][..=b];
                let at = j + b - i;
                row[at] = (row[at] - dot(&row[..at], &other[i - j..b])) / other[b];
            }
            let pivot = row[b] - dot(&row[..b], &row[..b]);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            row[b] = pivot.sqrt();
        }
        Some(Factor(self))
    }
}

/// The Cholesky factor L of a band matrix.
pub(super) struct Factor(Banded);

impl Factor {
    /// Replaces y by the solution x of LLᵀx = y.
    pub fn solve(&self, y: &mut [f64]) {
        let b = self.0.bandwidth;
        let span = |i: usize| (b.saturating_sub(i), i.saturating_sub(b)..i);
        for (i, row) in self.0.rows.chunks_exact(b + 1).enumerate() {
            let (first, before) = span(i);
            y[i] = (y[i] - dot(&row[first..b], &y[before])) / row[b];
        }
        for (i, row) in self.0.rows.chunks_exact(b + 1).enumerate().rev() {
            let (first, before) = span(i);
            y[i] /= row[b];
            let value = y[i];
            add_scaled(&mut y[before], &row[first..b], -value);
        }
    }
}

#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, ra), (b, rb)) = (a.as_chunks(), b.as_chunks());
    let sum = a.iter().zip(b).fold(f64x4::ZERO, |sum, (&a, &b)| sum + f64x4::new(a) * f64x4::new(b));
    let [p, q, r, s] = sum.to_array();
    ra.iter().zip(rb).fold((p + q) + (r + s), |sum, (a, b)| sum + a * b)
}

/// a += s·b.
#[inline(never)] // inlined it is a fifth of a kilobyte more
pub(super) fn add_scaled(a: &mut [f64], b: &[f64], s: f64) {
    let ((a, ra), (b, rb)) = (a.as_chunks_mut(), b.as_chunks());
    for (a, &b) in a.iter_mut().zip(b) {
        *a = (f64x4::new(*a) + f64x4::splat(s) * f64x4::new(b)).to_array();
    }
    ra.iter_mut().zip(rb).for_each(|(a, b)| *a += s * b);
}
