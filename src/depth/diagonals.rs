//! Symmetric positive definite matrices with few diagonals, and their Cholesky factorisation.

use wide::{f32x4, f64x4};

use crate::Result;
use crate::image::zeroed;
use crate::lanes::LANES;

/// Columns whose products are taken off all others at once.
const PANEL: usize = 4;

/// A symmetric matrix of which only some diagonals are not 0.
#[derive(Clone)]
pub(super) struct Diagonals {
    size: usize,
    /// How far each is from the main one.
    offsets: Vec<usize>,
    /// Of one after the other, the entries (j + offset, j).
    entries: Vec<f64>,
}

impl Diagonals {
    pub fn new(size: usize, offsets: Vec<usize>) -> Result<Self> {
        Ok(Self { size, entries: zeroed(size * offsets.len())?, offsets })
    }

    /// Adds to the entries (i, j) and (j, i); those of other diagonals are not there.
    #[inline(always)]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        if let Some(diagonal) = self.offsets.iter().position(|offset| *offset == i.abs_diff(j))
            && let Some(entry) = self.entries.get_mut(diagonal * self.size + i.min(j))
        {
            *entry += value;
        }
    }

    /// The product with a vector.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for (&offset, entries) in self.offsets.iter().zip(self.entries.chunks_exact(self.size)) {
            let count = self.size.saturating_sub(offset);
            add_product(&mut out[offset..], &entries[..count], &x[..count]);
            if offset > 0 {
                add_product(&mut out[..count], &entries[..count], &x[offset..]);
            }
        }
        out
    }

    /// L of A = LLᵀ; `None` when the matrix is not positive definite.
    pub fn cholesky(&self) -> Result<Option<Factor>> {
        let length = 1 + self.offsets.iter().max().copied().unwrap_or(0);
        let stride = length + PANEL - 1;
        let mut columns: Vec<f64> = zeroed(self.size * stride)?;
        for (&offset, entries) in self.offsets.iter().zip(self.entries.chunks_exact(self.size)) {
            columns.chunks_exact_mut(stride).zip(entries).for_each(|(column, entry)| column[offset] += entry);
        }
        let mut rest = &mut columns[..];
        while !rest.is_empty() {
            let (panel, right) = rest.split_at_mut(rest.len().min(PANEL * stride));
            for j in 0..panel.len() / stride {
                let (column, others) = panel[j * stride..].split_at_mut(stride);
                let pivot = column[0].sqrt();
                if pivot.is_nan() || pivot <= 0.0 {
                    return Ok(None);
                }
                column[0] = pivot;
                column[1..length].iter_mut().for_each(|entry| *entry /= pivot);
                for (k, other) in (1..length).zip(others.chunks_exact_mut(stride)) {
                    add_scaled(&mut other[..length - k], &column[k..length], -column[k]);
                }
            }
            // Only the last panel may be narrower, and nothing is right of it.
            for (k, other) in (1..length).zip(right.chunks_exact_mut(stride)) {
                // From the other's diagonal downwards: the first three end in zeros.
                let from = |j: usize| &panel[j * stride + k + PANEL - 1 - j..][..length - k];
                subtract_scaled(&mut other[..length - k], [from(0), from(1), from(2), from(3)]);
            }
            rest = right;
        }
        Factor::of(&columns, stride, length).map(Some)
    }
}

/// The Cholesky factor L of a matrix, in single precision: what a preconditioner needs.
pub(super) struct Factor {
    /// Column by column the reciprocal of L's main diagonal, what is below it in the band, and zeros. As many columns as fill panels.
    columns: Vec<f32>,
    stride: usize,
}

impl Factor {
    /// Of L's columns in double precision, so many entries of each, `apart` from one to the next.
    fn of(band: &[f64], apart: usize, length: usize) -> Result<Self> {
        let stride = (length - 1).next_multiple_of(LANES) + PANEL;
        let count = (band.len() / apart).next_multiple_of(PANEL);
        let mut columns: Vec<f32> = zeroed(count * stride)?;
        for (column, entries) in columns.chunks_exact_mut(stride).zip(band.chunks_exact(apart)) {
            column.iter_mut().zip(&entries[..length]).for_each(|(to, &entry)| *to = entry as f32);
            column[0] = (1.0 / entries[0]) as f32;
        }
        Ok(Self { columns, stride })
    }

    /// About the solution x of LLᵀx = y.
    pub fn solve(&self, y: &[f64]) -> Vec<f64> {
        let (stride, below) = (self.stride, self.stride - PANEL);
        let mut x = vec![0.0; self.columns.len() / stride + below];
        x.iter_mut().zip(y).for_each(|(x, &y)| *x = y as f32);
        let panels = || self.columns.chunks_exact(PANEL * stride).enumerate();
        for (p, panel) in panels() {
            let (head, tail) = x[PANEL * p..][..PANEL + below].split_at_mut(PANEL);
            for j in 0..PANEL {
                let column = &panel[j * stride..];
                head[j] *= column[0];
                for k in j + 1..PANEL {
                    head[k] -= column[k - j] * head[j];
                }
            }
            let [p, q, r, s] = [0, 1, 2, 3].map(|j| f32x4::splat(head[j]));
            for (four, [a, b, c, d]) in tail.as_chunks_mut().0.iter_mut().zip(beneath(panel, stride)) {
                *four = (f32x4::new(*four) - (p * a + q * b) - (r * c + s * d)).to_array();
            }
        }
        for (p, panel) in panels().rev() {
            let (head, tail) = x[PANEL * p..][..PANEL + below].split_at_mut(PANEL);
            let mut sums = [f32x4::ZERO; PANEL];
            for (&four, columns) in tail.as_chunks().0.iter().zip(beneath(panel, stride)) {
                sums.iter_mut().zip(columns).for_each(|(sum, column)| *sum += column * f32x4::new(four));
            }
            for j in (0..PANEL).rev() {
                let column = &panel[j * stride..];
                let [a, b, c, d] = sums[j].to_array();
                let mut rest = head[j] - ((a + b) + (c + d));
                for k in j + 1..PANEL {
                    rest -= column[k - j] * head[k];
                }
                head[j] = rest * column[0];
            }
        }
        x[..y.len()].iter().map(|&x| f64::from(x)).collect()
    }
}

/// What is below a panel, four rows of all its columns at a time.
#[inline(always)]
fn beneath(panel: &[f32], stride: usize) -> impl Iterator<Item = [f32x4; PANEL]> {
    let [a, b, c, d] = [0, 1, 2, 3].map(|j| panel[j * stride + PANEL - j..][..stride - PANEL].as_chunks().0.iter());
    a.zip(b).zip(c).zip(d).map(|(((&a, &b), &c), &d)| [a, b, c, d].map(f32x4::new))
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

/// a −= b₀·b for four b, the first after the other.
fn subtract_scaled(a: &mut [f64], b: [&[f64]; PANEL]) {
    let scales = b.map(|b| b.first().copied().unwrap_or_default());
    let [p, q, r, s] = scales.map(f64x4::splat);
    let (a, last) = a.as_chunks_mut();
    let [(b, rb), (c, rc), (d, rd), (e, re)] = b.map(|b| b.as_chunks());
    for ((((a, &b), &c), &d), &e) in a.iter_mut().zip(b).zip(c).zip(d).zip(e) {
        let less = f64x4::new(*a) - p * f64x4::new(b) - q * f64x4::new(c);
        *a = (less - r * f64x4::new(d) - s * f64x4::new(e)).to_array();
    }
    let [p, q, r, s] = scales;
    for ((((a, b), c), d), e) in last.iter_mut().zip(rb).zip(rc).zip(rd).zip(re) {
        *a = *a - p * b - q * c - r * d - s * e;
    }
}

/// a += b·c, entry by entry.
fn add_product(a: &mut [f64], b: &[f64], c: &[f64]) {
    let ((a, ra), (b, rb), (c, rc)) = (a.as_chunks_mut(), b.as_chunks(), c.as_chunks());
    for ((a, &b), &c) in a.iter_mut().zip(b).zip(c) {
        *a = (f64x4::new(*a) + f64x4::new(b) * f64x4::new(c)).to_array();
    }
    ra.iter_mut().zip(rb).zip(rc).for_each(|((a, b), c)| *a += b * c);
}
