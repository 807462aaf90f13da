//! Structural similarity, row by row.
//!
//! Z. Wang et al., *Image Quality Assessment: From Error Visibility to Structural Similarity*, IEEE TIP 13 (2004), with
//! the border treatment of scikit-image (`gaussian_weights=True, use_sample_covariance=False, data_range=255`).
//! Rows are taken in one after the other and kept for as long as a window reaches them, so that memory grows with the
//! width only.

use wide::f32x4;

use super::Overlap;
use crate::Result;
use crate::image::zeroed;
use crate::rows::{Block, Kernel, Mirror, Smoother, Window};

/// The window reaches 3.5 σ.
const RADIUS: usize = 5;
const TAPS: usize = 2 * RADIUS + 1;
const SIGMA: f64 = 1.5;
const C1: f32 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f32 = (0.03 * 255.0) * (0.03 * 255.0);
/// Gray levels are taken relative to this: variances do not change, but their rounding errors shrink fourfold.
const MIDDLE: f32 = 128.0;
const CHANNELS: usize = 3;
/// What is smoothed: of target t and reference r, t, r, t² + r² and t·r.
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
    let (kernel, _) = Kernel::bell(SIGMA * SIGMA, RADIUS);
    let mut smoother = Smoother::new(width, height, CHANNELS, Mirror::AtEdge)?;
    let windows = |rows: usize| -> Result<Vec<Window>> {
        let mut windows = Vec::new();
        for _ in 0..MAPS {
            windows.push(Window::new(CHANNELS * width, rows)?);
        }
        Ok(windows)
    };
    // The maps as they are and smoothed.
    let (mut plain, mut smooth) = (windows(TAPS)?, windows(1)?);
    let mut map: Vec<Block> = zeroed(plain[0].blocks(0).len())?;
    let (mut whole, mut masked) = (0.0, 0.0);
    for y in 0..height {
        while plain[0].rows < height.min(y + RADIUS + 1) {
            let (target, reference) = overlap.row(plain[0].rows);
            take_in(target, reference, &mut plain);
        }
        for (from, to) in plain.iter().zip(&mut smooth) {
            smoother.append(from, &kernel, to);
        }
        compare(&smooth, y, &mut map);
        let map: &[f32] = bytemuck::cast_slice(&map);
        if y >= border && y < height - border {
            whole += map[CHANNELS * border..CHANNELS * (width - border)].iter().map(|&s| f64::from(s)).sum::<f64>();
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

/// Appends a row: red, green, blue, red, … so that one loop smooths all three.
fn take_in(target: &[[u8; 4]], reference: &[[u8; 4]], maps: &mut [Window]) {
    let [t, r, squares, product] = maps else { return };
    let (t, r) = (t.next(), r.next());
    let values = bytemuck::cast_slice_mut::<_, f32>(t).as_chunks_mut::<CHANNELS>().0.iter_mut();
    let others = bytemuck::cast_slice_mut::<_, f32>(r).as_chunks_mut::<CHANNELS>().0.iter_mut();
    for (((t, r), target), reference) in values.zip(others).zip(target).zip(reference) {
        for c in 0..CHANNELS {
            let (a, b) = if target[3] != 0 { (target[c], reference[c]) } else { (0, 0) };
            (t[c], r[c]) = (f32::from(a) - MIDDLE, f32::from(b) - MIDDLE);
        }
    }
    let squares = squares.next().as_flattened_mut().iter_mut().zip(product.next().as_flattened_mut());
    for ((&t, &r), (s, p)) in t.as_flattened().iter().zip(r.as_flattened()).zip(squares) {
        (*s, *p) = (t * t + r * r, t * r);
    }
}

/// SSIM of every value of row `y`.
fn compare(smooth: &[Window], y: usize, out: &mut [Block]) {
    let [t, r, squares, product] = [0, 1, 2, 3].map(|map| smooth[map].blocks(y).as_flattened());
    let (one, two, middle) = (f32x4::splat(C1), f32x4::splat(C2), f32x4::splat(MIDDLE));
    for ((((out, &t), &r), &squares), &product) in
        out.as_flattened_mut().iter_mut().zip(t).zip(r).zip(squares).zip(product)
    {
        let variances = squares - (t * t + r * r);
        let covariance = product - t * r;
        // The means themselves are not relative to the middle.
        let (t, r) = (t + middle, r + middle);
        let tr = t * r;
        *out = ((tr + tr + one) * (covariance + covariance + two)) / ((t * t + r * r + one) * (variances + two));
    }
}
