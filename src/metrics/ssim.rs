//! Structural similarity, row by row.
//!
//! Z. Wang et al., *Image Quality Assessment: From Error Visibility to Structural Similarity*, IEEE TIP 13 (2004), with
//! the border treatment of scikit-image (`gaussian_weights=True, use_sample_covariance=False, data_range=255`).
//! The Gaussian is separable: each row is filtered along x once and kept for as long as a window reaches it, so that
//! memory grows with the width only.

use super::Overlap;
use crate::Result;
use crate::image::zeroed;

/// The window reaches 3.5 σ.
const RADIUS: usize = 5;
const TAPS: usize = 2 * RADIUS + 1;
const SIGMA: f64 = 1.5;
const C1: f32 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f32 = (0.03 * 255.0) * (0.03 * 255.0);
/// Grey levels are taken relative to this: variances do not change, but their rounding errors shrink fourfold.
const MIDDLE: f32 = 128.0;
/// Values of a row are red, green, blue, red, … so that one loop filters all three.
const CHANNELS: usize = 3;
/// What is filtered: target t, reference r, t² + r², t·r.
const MAPS: usize = 4;

/// Mean SSIM.
pub(super) struct Similarity {
    /// Over the rectangle without its border.
    pub whole: f64,
    /// Over the valid pixels.
    pub masked: f64,
}

/// SSIM of the two pictures, both black where the target is not valid; `covered` is how many pixels are.
pub(super) fn similarity(overlap: &Overlap<'_>, covered: u64) -> Result<Similarity> {
    let (width, height) = (overlap.width, overlap.height);
    let border = if width.min(height) < TAPS { 0 } else { RADIUS };
    let kernel = kernel();
    let mut rows = FilteredRows::new(width)?;
    let mut map: Vec<f32> = zeroed(CHANNELS * width)?;
    let mut next = 0;
    let (mut whole, mut masked) = (0.0, 0.0);
    for y in 0..height {
        while next < height.min(y + RADIUS + 1) {
            let (target, reference) = overlap.row(next);
            rows.filter(&kernel, target, reference, next);
            next += 1;
        }
        rows.similarity(&kernel, |tap| mirror(y, tap, height), &mut map);
        let inner = CHANNELS * border..CHANNELS * (width - border);
        if y >= border && y < height - border {
            whole += map[inner].iter().map(|&s| f64::from(s)).sum::<f64>();
        }
        for (s, pixel) in map.as_chunks::<CHANNELS>().0.iter().zip(overlap.row(y).0) {
            if pixel[3] != 0 {
                masked += f64::from(s[0] + s[1] + s[2]);
            }
        }
    }
    let inner = (width - 2 * border) as f64 * (height - 2 * border) as f64;
    Ok(Similarity { whole: whole / (3.0 * inner), masked: masked / (3.0 * covered as f64) })
}

fn kernel() -> [f32; TAPS] {
    let bell: [f64; TAPS] = std::array::from_fn(|tap| {
        let x = tap as f64 - RADIUS as f64;
        libm::exp(-x * x / (2.0 * SIGMA * SIGMA))
    });
    let sum = bell.iter().sum::<f64>();
    bell.map(|v| (v / sum) as f32)
}

/// Index under a tap of the window at `i`, where d c b a | a b c d | d c b a goes on for ever.
fn mirror(i: usize, tap: usize, len: usize) -> usize {
    let period = 2 * len as isize;
    let at = (i as isize + tap as isize - RADIUS as isize).rem_euclid(period) as usize;
    at.min(2 * len - 1 - at)
}

/// The last rows, filtered along x.
struct FilteredRows {
    width: usize,
    /// Each map of one row with a mirrored border, before filtering.
    padded: [Vec<f32>; MAPS],
    /// Row y is at y mod TAPS.
    rows: [[Vec<f32>; MAPS]; TAPS],
}

impl FilteredRows {
    fn new(width: usize) -> Result<Self> {
        let mut rows: [[Vec<f32>; MAPS]; TAPS] = Default::default();
        for map in rows.iter_mut().flatten() {
            *map = zeroed(CHANNELS * width)?;
        }
        let mut padded: [Vec<f32>; MAPS] = Default::default();
        for map in &mut padded {
            *map = zeroed(CHANNELS * (width + 2 * RADIUS))?;
        }
        Ok(Self { width, padded, rows })
    }

    /// Takes in row `y`.
    fn filter(&mut self, kernel: &[f32; TAPS], target: &[[u8; 4]], reference: &[[u8; 4]], y: usize) {
        let [t, r, squares, product] = &mut self.padded;
        for (x, (&target, &reference)) in target.iter().zip(reference).enumerate() {
            let at = CHANNELS * (x + RADIUS);
            for c in 0..CHANNELS {
                let (a, b) = if target[3] != 0 { (target[c], reference[c]) } else { (0, 0) };
                (t[at + c], r[at + c]) = (f32::from(a) - MIDDLE, f32::from(b) - MIDDLE);
            }
        }
        for map in [&mut *t, &mut *r] {
            for tap in 0..RADIUS {
                let (before, after) = (mirror(0, tap, self.width), mirror(self.width - 1, TAPS - 1 - tap, self.width));
                for c in 0..CHANNELS {
                    map[CHANNELS * tap + c] = map[CHANNELS * (before + RADIUS) + c];
                    map[CHANNELS * (self.width + 2 * RADIUS - 1 - tap) + c] = map[CHANNELS * (after + RADIUS) + c];
                }
            }
        }
        for (((&t, &r), s), p) in t.iter().zip(r.iter()).zip(squares).zip(product) {
            (*s, *p) = (t * t + r * r, t * r);
        }
        for (map, out) in self.padded.iter().zip(&mut self.rows[y % TAPS]) {
            weighted_sum(kernel, std::array::from_fn(|tap| &map[CHANNELS * tap..]), out);
        }
    }

    /// SSIM of every value of a row, where `row` says which row is under each tap of the window.
    fn similarity(&mut self, kernel: &[f32; TAPS], row: impl Fn(usize) -> usize, out: &mut [f32]) {
        let under: [&[Vec<f32>; MAPS]; TAPS] = std::array::from_fn(|tap| &self.rows[row(tap) % TAPS]);
        // The unfiltered row is not needed between two rows: its memory takes the means.
        for (map, mean) in self.padded.iter_mut().enumerate() {
            weighted_sum(kernel, under.map(|maps| maps[map].as_slice()), &mut mean[..out.len()]);
        }
        let [t, r, squares, product] = &self.padded;
        for ((((out, &t), &r), &squares), &product) in out.iter_mut().zip(t).zip(r).zip(squares).zip(product) {
            let (t2r2, tr) = (t * t + r * r, t * r);
            let variances = squares - t2r2;
            let covariance = product - tr;
            // The means themselves are not relative to the middle.
            let (t, r) = (t + MIDDLE, r + MIDDLE);
            *out = ((2.0 * (t * r) + C1) * (2.0 * covariance + C2)) / ((t * t + r * r + C1) * (variances + C2));
        }
    }
}

/// out[i] = Σ kernel[tap]·rows[tap][i], the kernel being symmetric.
fn weighted_sum(kernel: &[f32; TAPS], rows: [&[f32]; TAPS], out: &mut [f32]) {
    let rows = rows.map(|row| &row[..out.len()]);
    for (i, out) in out.iter_mut().enumerate() {
        let mut sum = kernel[RADIUS] * rows[RADIUS][i];
        for tap in 0..RADIUS {
            sum += kernel[tap] * (rows[tap][i] + rows[TAPS - 1 - tap][i]);
        }
        *out = sum;
    }
}
