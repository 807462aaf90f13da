//! Sub-pixel refinement: least-squares matching of gray values along the epipolar line (Lucas & Kanade 1981). Census costs,
//! which count pixels, cannot resolve it.

use wide::f32x4;

use super::census::{CostRows, LABELS, Search};
use super::gray::MARGIN;
use crate::Result;
use crate::image::zeroed;
use crate::lanes::{LANES, load};

/// Pixels between the two places of the other photo that a slope is taken from: the unit of all shifts below, the most that
/// a shift changes, and how different those of neighbours may be. Tuned on the evaluation cases, as all below:
/// PSNR, coverage and bending are flat between half and twice of each, but for COHESION, where 5 bends 2 % less.
pub(super) const SPAN: f32 = 0.8;
/// Sum of squared slopes, in gray levels, at which half of the change is applied, where the prior is not exact.
const DAMPING: f32 = 96.0;
/// Weight of the difference to each neighbour's shift, in the same unit.
const COHESION: f32 = 10.0;
/// Weight of a pixel that is not reliable.
const UNRELIABLE: f32 = 0.25;

/// Half the window.
const RADIUS: usize = 2;
const ROWS: usize = 2 * RADIUS + 1;
/// Values of a pixel: its shift; how much brighter the other photo is where it leads to, and the slope of that along the
/// epipolar line; how much these two count. Rows have [`LANES`] zeros beyond the left border and at least as many beyond the
/// right.
const PLANES: usize = 4;

/// Refines the shifts of all pixels by one Gauss–Newton step: they are the middle labels of `search`, of which the first and
/// the last are [`SPAN`] pixels apart. It minimises the squared differences of the windows around them, but for an offset of
/// brightness. A neighbour counts by how near its own shift is.
pub(super) fn refine_subpixel(search: &Search<'_>, shifts: &mut [f32], reliable: &[u8]) -> Result<()> {
    let (width, height) = (search.from.width, search.from.height);
    let stride = width.next_multiple_of(LANES) + 2 * LANES;
    let start = |y: usize| y * PLANES * stride + LANES;
    let mut data: Vec<f32> = zeroed(start(height + 2 * RADIUS))?;
    let span = search.step * (LABELS - 1) as f32;
    let per_span = 1.0 / span;
    // Noise would only spoil what is nearly exact already.
    let cost = f32::from(search.leaving_cost.max(1));
    let damping = DAMPING * cost * cost * cost;
    let mut source = CostRows::new(search)?;
    for y in 0..height {
        source.sample_row();
        let gray = &search.from.row(y as isize)[MARGIN..];
        for (x, &gray) in gray.iter().enumerate().take(width) {
            let (i, at) = (y * width + x, start(y + RADIUS) + x);
            let [a, b, counts] = source.ends(x);
            let counts = if reliable[i] != 0 { counts } else { counts * UNRELIABLE };
            let values = [shifts[i] * per_span, 0.5 * (a + b) - f32::from(gray), b - a, counts];
            for (plane, value) in values.into_iter().enumerate() {
                data[at + plane * stride] = value;
            }
        }
    }
    for (y, shifts) in shifts.chunks_exact_mut(width).enumerate() {
        for (block, shifts) in shifts.chunks_mut(LANES).enumerate() {
            let by = steps(&data[start(y) - RADIUS + block * LANES..], stride, damping) * span;
            shifts.iter_mut().zip(by.to_array()).for_each(|(shift, by)| *shift += by);
        }
    }
    Ok(())
}

/// The changes of the shifts of pixels next to each other; their windows start at the first value.
fn steps(data: &[f32], stride: usize, damping: f32) -> f32x4 {
    let load = |dx: usize, dy: usize, plane: usize| load(data, (dy * PLANES + plane) * stride + dx);
    let (own, counts) = (load(RADIUS, RADIUS, 0), load(RADIUS, RADIUS, 3));
    let [mut n, mut g, mut e, mut gg, mut ge, mut apart] = [f32x4::ZERO; 6];
    for tap in 0..ROWS * ROWS {
        let (dx, dy) = (tap % ROWS, tap / ROWS);
        let (x, y) = (dx.abs_diff(RADIUS), dy.abs_diff(RADIUS));
        if x + y > RADIUS {
            continue;
        }
        let (away, slope) = (load(dx, dy, 0) - own, load(dx, dy, 2));
        let near = (f32x4::ONE - away * away).fast_max(f32x4::ZERO);
        let weight = near * load(dx, dy, 3) * (1.0 - (x * x + y * y) as f32 / 9.0);
        // As it would be with the shift in the middle.
        let difference = load(dx, dy, 1) - slope * away;
        let weighted = weight * slope;
        n += weight;
        g += weighted;
        e += weight * difference;
        gg += weighted * slope;
        ge += weighted * difference;
        apart += weight * away;
    }
    let mean = g / n.fast_max(f32x4::splat(0.1));
    let by = (apart * COHESION - counts * (ge - mean * e)) / (n * COHESION + counts * (gg - mean * g) + damping);
    by.fast_max(-f32x4::ONE).fast_min(f32x4::ONE)
}
