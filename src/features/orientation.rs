//! Dominant directions of the gradient around a keypoint (Lowe 2004, section 5).

use wide::f32x4;

use super::approximation::{TURN, angle, bell};
use super::scale_space::Plane;

const BINS: usize = 36;
/// The window's deviation, in σ of the keypoint.
const WINDOW: f32 = 1.5;
/// Where the window is cut off, in its deviations.
const CUT: f32 = 3.0;
/// A lesser peak counts when it reaches this share of the highest.
const PEAK: f32 = 0.8;
/// Most columns in a window: σ is below 3 px.
const MOST: usize = 32;

/// Calls `found` with every dominant direction around (x, y), in [`TURN`]-ths of a turn. `sigma` is the keypoint's, in
/// pixels of the plane.
pub(super) fn orientations(plane: &Plane, [x, y]: [f32; 2], sigma: f32, found: &mut dyn FnMut(f32)) {
    let histogram = smooth(histogram(plane, [x, y], sigma));
    let highest = histogram.iter().fold(0.0f32, |a, &b| a.max(b));
    for (i, &here) in histogram.iter().enumerate() {
        let (before, after) = (histogram[(i + BINS - 1) % BINS], histogram[(i + 1) % BINS]);
        if here > before && here > after && here >= PEAK * highest {
            let offset = 0.5 * (before - after) / (before - 2.0 * here + after);
            let bin = i as f32 + offset;
            let bin = if bin < 0.0 { bin + BINS as f32 } else { bin };
            let direction = bin * (TURN / BINS as f32);
            found(if direction < TURN { direction } else { 0.0 });
        }
    }
}

/// Magnitudes by direction, bin i being centred at i.
#[inline(never)] // the first detection takes 349 ms instead of 364, see `crate::rows`
fn histogram(plane: &Plane, [x, y]: [f32; 2], sigma: f32) -> [f32; BINS] {
    let deviation = WINDOW * sigma;
    let radius = CUT * deviation;
    let falloff = 0.5 / (deviation * deviation);
    let mut histogram = [0.0f32; BINS];
    let span = |centre: f32, radius: f32, size: usize| -> (usize, usize) {
        // The cast takes what is negative for zero.
        ((centre - radius) as usize + 1, ((centre + radius) as usize + 1).min(size - 1))
    };
    let (top, bottom) = span(y, radius, plane.height);
    let (left, right) = span(x, radius, plane.width);
    let (mut across, mut down) = ([0.0; MOST], [0.0; MOST]);
    bell(left as f32 - x, falloff, &mut across);
    bell(top as f32 - y, falloff, &mut down);
    for (row, weight) in (top..bottom).zip(down).step_by(plane.rows_apart()) {
        let dy = row as f32 - y;
        let half = (radius * radius - dy * dy).max(0.0).sqrt();
        let (first, end) = span(x, half, plane.width);
        let (first, end) = (first.max(left), end.min(right));
        let mut column = first;
        while column < end {
            let (gx, gy) = plane.gradient(column, row);
            let magnitude = ((gx * gx + gy * gy).sqrt() * f32x4::splat(weight)).to_array();
            // The nearest bin, as an integer.
            let bins = angle(gx, gy) * f32x4::splat(BINS as f32 / TURN) + f32x4::splat(0.5);
            let bins = bins.fast_trunc_int().to_array();
            for lane in 0..4.min(end - column) {
                let bin = bins[lane] as usize;
                let bin = if bin < BINS { bin } else { 0 };
                histogram[bin] += magnitude[lane] * across.get(column - left + lane).copied().unwrap_or(0.0);
            }
            column += 4;
        }
    }
    histogram
}

/// Smoothed with [1 4 6 4 1]/16, around.
fn smooth(histogram: [f32; BINS]) -> [f32; BINS] {
    let mut out = [0.0; BINS];
    for (i, out) in out.iter_mut().enumerate() {
        let at = |k: usize| histogram[(i + BINS + k - 2) % BINS];
        *out = (at(0) + at(4)) * (1.0 / 16.0) + (at(1) + at(3)) * (4.0 / 16.0) + at(2) * (6.0 / 16.0);
    }
    out
}
