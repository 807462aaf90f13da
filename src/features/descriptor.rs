//! The 4×4 histograms of gradients around a keypoint (Lowe 2004, section 6).

use wide::{CmpGe, f32x4, i32x4};

use super::approximation::{TURN, angle, bell, cos_sin};
use super::scale_space::Plane;
use crate::lanes::load;

/// Cells along a side.
const CELLS: usize = 4;
/// Directions in a cell.
const BINS: usize = TURN as usize;
/// Values in a descriptor.
pub const DESCRIPTOR_LENGTH: usize = CELLS * CELLS * BINS;
/// Side of a cell, in σ of the keypoint.
const CELL: f32 = 3.0;
/// Farthest pixel that takes part, in σ: the corner of the outer cells' neighbours.
pub(super) const SUPPORT: f32 = CELL * (CELLS as f32 + 1.0) / 2.0 * std::f32::consts::SQRT_2;
/// Values of a unit descriptor are clipped to this, as large ones depend on the illumination (Lowe 2004, section 6.1).
const CUT: f32 = 0.2;
/// Factor of a unit descriptor before it is rounded to bytes.
pub(super) const SCALE: f32 = 512.0;
/// Most columns in a window: half of it is 2.5·√2 cells, and σ is below 3 px.
const MOST: usize = 64;

/// Where four neighbouring cells meet, from the one whose centre is above and left of a sample; of every direction the
/// four cells' sums are in the lanes: top left, top right, bottom left, bottom right. Index: (row·5 + column)·8 + direction.
type Corners = [f32x4; 256];
/// Such places along a side: the cells outside the window take part and are dropped at the end.
const PLACES: usize = CELLS + 1;

/// Describes the keypoint at (x, y) with this σ, in pixels of the plane, turned by `direction` in [`TURN`]-ths of a turn.
pub(super) fn describe(
    plane: &Plane,
    [x, y]: [f32; 2],
    sigma: f32,
    direction: f32,
    root: bool,
) -> [u8; DESCRIPTOR_LENGTH] {
    let mut corners: Corners = [f32x4::splat(0.0); 256];
    accumulate(plane, [x, y], sigma, direction, &mut corners);
    quantise(&gather(&corners), root)
}

#[inline(never)] // the first detection takes 349 ms instead of 364, see `crate::rows`
fn accumulate(plane: &Plane, [x, y]: [f32; 2], sigma: f32, direction: f32, corners: &mut Corners) {
    let side = CELL * sigma;
    // A sample counts for a cell up to one cell's side from its centre.
    let half = (CELLS as f32 + 1.0) / 2.0;
    let (cos, sin) = cos_sin(direction);
    let radius = side * half * (cos.abs() + sin.abs());
    let (cos, sin) = (cos / side, sin / side);
    let span = |low: f32, high: f32, size: usize| -> (usize, usize) {
        // The cast takes what is negative for zero.
        (low as usize + 1, (high as usize + 1).min(size - 1))
    };
    let (top, bottom) = span(y - radius, y + radius, plane.height);
    let (left, right) = span(x - radius, x + radius, plane.width);
    // The weight is a Gaussian with a deviation of half the window, which is separable as it does not turn.
    let falloff = 1.0 / (side * side * 0.5 * (CELLS * CELLS) as f32);
    let (mut across, mut down) = ([0.0; MOST + 4], [0.0; MOST]);
    bell(left as f32 - x, falloff, &mut across);
    bell(top as f32 - y, falloff, &mut down);
    let lanes = f32x4::new([0.0, 1.0, 2.0, 3.0]);
    let middle = f32x4::splat(CELLS as f32 / 2.0 - 0.5);
    // A sample's shares of the four cells are linear in its place between them.
    let (upper, lower) = (f32x4::new([1.0, 1.0, 0.0, 0.0]), f32x4::new([-1.0, -1.0, 1.0, 1.0]));
    let (before, behind) = (f32x4::new([1.0, 0.0, 1.0, 0.0]), f32x4::new([-1.0, 1.0, -1.0, 1.0]));
    for (row, weight) in (top..bottom).zip(down).step_by(plane.rows_apart()) {
        let dy = row as f32 - y;
        let (low, high) = columns((cos, sin), dy, half, radius);
        let (first, end) = span(x + low, x + high, plane.width);
        let (first, end) = (first.max(left), end.min(right));
        let mut column = first;
        while column < end {
            let (gx, gy) = plane.gradient(column, row);
            let bell = load(&across, column - left);
            let outside = lanes.cmp_ge(f32x4::splat((end - column) as f32));
            let magnitude = outside.blend(f32x4::splat(0.0), (gx * gx + gy * gy).sqrt() * bell * f32x4::splat(weight));
            let dx = f32x4::splat(column as f32 - x) + lanes;
            let u = dx * f32x4::splat(cos) + f32x4::splat(dy * sin) + middle;
            let v = f32x4::splat(dy * cos) - dx * f32x4::splat(sin) + middle;
            let (i, fu) = split(u);
            let (j, fv) = split(v);
            let turned = angle(gx, gy) + f32x4::splat(TURN - direction);
            let k = turned.fast_trunc_int();
            let fk = turned - f32x4::from_i32x4(k);
            let place = (j * PLACES as i32 + i) * BINS as i32;
            let (magnitude, fu, fv, fk) = (magnitude.to_array(), fu.to_array(), fv.to_array(), fk.to_array());
            let (place, k) = (place.to_array(), k.to_array());
            for lane in 0..4 {
                let weights = (lower * fv[lane] + upper) * magnitude[lane] * (behind * fu[lane] + before);
                let next = weights * fk[lane];
                let bin = k[lane] as usize;
                corners[(place[lane] as usize + bin % BINS) % 256] += weights - next;
                corners[(place[lane] as usize + (bin + 1) % BINS) % 256] += next;
            }
            column += 4;
        }
    }
}

/// The range of dx in which both |dx·cos + dy·sin| and |dy·cos − dx·sin| are less than `half`, within ±`radius`.
fn columns((cos, sin): (f32, f32), dy: f32, half: f32, radius: f32) -> (f32, f32) {
    let (mut low, mut high) = (-radius, radius);
    for (slope, shift) in [(cos, dy * sin), (-sin, dy * cos)] {
        if slope.abs() * radius > 1e-3 {
            let (a, b) = ((-half - shift) / slope, (half - shift) / slope);
            let (a, b) = if a < b { (a, b) } else { (b, a) };
            low = if low < a { a } else { low };
            high = if b < high { b } else { high };
        }
    }
    (low, high)
}

/// The cell before a coordinate, counted from one before the first, and the fraction. Coordinates beyond the cells around
/// the window are clamped to their rim, where they have no weight.
#[inline(always)]
fn split(coordinate: f32x4) -> (i32x4, f32x4) {
    let at = (coordinate + f32x4::splat(1.0)).fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(PLACES as f32 - 1e-4));
    let whole = at.fast_trunc_int();
    (whole, at - f32x4::from_i32x4(whole))
}

/// What each cell got from the four places around its centre.
fn gather(corners: &Corners) -> [f32; DESCRIPTOR_LENGTH] {
    let mut cells = [0.0; DESCRIPTOR_LENGTH];
    for (index, value) in cells.iter_mut().enumerate() {
        let (row, column, bin) = (index / (CELLS * BINS), index / BINS % CELLS, index % BINS);
        let at = |down: usize, right: usize, lane: usize| {
            corners[((row + down) * PLACES + column + right) * BINS + bin].as_array_ref()[lane]
        };
        *value = (at(1, 1, 0) + at(1, 0, 1)) + (at(0, 1, 2) + at(0, 0, 3));
    }
    cells
}

/// The descriptor in bytes: the histograms or, if `root`, their square roots: R. Arandjelović and A. Zisserman, *Three things everyone should
/// know to improve object retrieval*, CVPR 2012.
fn quantise(cells: &[f32; DESCRIPTOR_LENGTH], root: bool) -> [u8; DESCRIPTOR_LENGTH] {
    let limit = CUT * norm(cells);
    let values = cells.map(|v| {
        let v = if v < limit { v } else { limit };
        if root { v.sqrt() } else { v }
    });
    let scale = SCALE / norm(&values).max(f32::MIN_POSITIVE);
    values.map(|v| (v * scale + 0.5) as u8)
}

fn norm(values: &[f32; DESCRIPTOR_LENGTH]) -> f32 {
    let (vectors, _) = values.as_chunks::<4>();
    let sums = vectors.iter().map(|&v| f32x4::from(v)).fold(f32x4::splat(0.0), |sum, v| sum + v * v);
    sums.to_array().iter().sum::<f32>().sqrt()
}
