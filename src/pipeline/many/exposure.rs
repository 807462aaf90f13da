//! How much light each photo took, from all overlaps at once (after Brown & Lowe, *Automatic Panoramic Image Stitching using Invariant
//! Features*, 2007, section 6).

use wide::f32x4;

use super::align::ManyAlignment;
use super::result::Photo;
use crate::geometry::Equations;
use crate::image::filled;
use crate::pipeline::bilinear::{Bilinear, in_cells};
use crate::rect::diagonal;
use crate::srgb::{USABLE, linear_light};
use crate::statistics::median;
use crate::{ImageView, Result};

/// Cells along the longer side of a photo.
const CELLS: usize = 96;
/// Pixels looked at, about, per side of a cell.
const TAPS: usize = 6;
/// Fewer cells that two photos share say nothing.
const FEWEST: usize = 12;
/// How far from itself, as a share of the diagonal, a place may land that is carried to another photo and back: otherwise something
/// else is in front there.
const RETURN: f64 = 0.01;
/// Rounds of reweighting.
const ROUNDS: usize = 20;
/// An overlap that all others contradict by more than this, in logarithms of light, loses weight (Huber). Not more than that: a full turn
/// that does not close is then put right a little everywhere.
const NOISE: f64 = 0.1;
/// Pull towards what the camera recorded, in cells; and towards it for the reference, which stays as it is.
const PRIOR: f64 = 0.1;
const FIXED: f64 = 1e9;

/// From the first of these on, the mean logarithm of the gains is no longer left as the reference has it: from the second on it becomes 0. Of some 80
/// sets seven have more than .3, and six of them look much too dark or burnt out: rooms whose reference shows a bright screen, a sunset whose reference
/// is dark.
const UNUSUAL: [f64; 2] = [0.3, 0.5];

/// Mean linear light of the cells of a photo.
struct Light {
    /// Pixels along the side of a cell.
    side: usize,
    columns: usize,
    /// Red, green, blue and 0: NaN where pixels are masked, clipped or dark. What is left of the photo on the right and below is in none.
    cells: Vec<f32x4>,
}

/// What two photos say of each other.
struct Overlap {
    photos: [usize; 2],
    /// Logarithm of the second's light over the first's, by channel.
    ratio: [f64; 3],
    /// Cells.
    count: f64,
}

/// How bright photos and picture are to be.
pub(super) struct JointExposure {
    /// What the red, green and blue of each photo have to be multiplied by, in linear light, so that all agree best with each other; the
    /// reference's by 1 or, where the picture would be burnt out, by less. `None` for a photo that nothing ties to the reference.
    pub gains: Vec<Option<[f64; 3]>>,
    /// How much brighter than that what is dark in the picture is to be: 1 or more.
    pub lift: f64,
}

/// Finds it from what the photos show of the same places.
pub(super) fn joint_exposure(photos: &[Photo<'_>], alignment: &ManyAlignment) -> Result<JointExposure> {
    let linear = linear_light();
    let mut light: Vec<Option<Light>> = Vec::new();
    for (i, photo) in photos.iter().enumerate() {
        light.push(if alignment.order.contains(&i) { Some(Light::of(photo.image, &linear)?) } else { None });
    }
    let mut overlaps = Vec::new();
    for (a, first) in light.iter().enumerate() {
        for (b, second) in light.iter().enumerate().skip(a + 1) {
            if let (Some(first), Some(second)) = (first, second) {
                overlaps.extend(overlap([a, b], [first, second], photos, alignment));
            }
        }
    }
    let mut gains = solve(photos.len(), alignment.reference, &overlaps);
    gains[alignment.reference] = Some([1.0; 3]);
    let common = common_gain(gains.iter().flatten());
    gains.iter_mut().flatten().flatten().for_each(|gain| *gain *= common.min(1.0));
    Ok(JointExposure { gains, lift: common.max(1.0) })
}

/// What all are to be multiplied by so that the picture is about as bright as the photos are: 1 where they are about as bright as the reference.
fn common_gain<'a>(gains: impl Iterator<Item = &'a [f64; 3]>) -> f64 {
    let logarithms: Vec<f64> = gains.flatten().map(|gain| libm::log(*gain)).collect();
    let mean = logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64;
    let [from, to] = UNUSUAL;
    libm::exp(-mean * ((mean.abs() - from) / (to - from)).clamp(0.0, 1.0))
}

impl Light {
    fn of(photo: ImageView<'_>, linear: &[f32; 256]) -> Result<Self> {
        let (width, height) = photo.size();
        let side = width.max(height).div_ceil(CELLS).max(2);
        let (columns, rows) = (width / side, height / side);
        let stride = (side / TAPS).max(1);
        let mut cells = filled(columns * rows, f32x4::splat(f32::NAN))?;
        for (i, cell) in cells.iter_mut().enumerate() {
            let (left, top) = (i % columns * side, i / columns * side);
            let (mut sum, mut count, mut all) = ([0.0; 3], 0.0f32, 0.0f32);
            for y in (top..top + side).step_by(stride) {
                for pixel in photo.pixels()[y * width + left..][..side].iter().step_by(stride) {
                    all += 1.0;
                    if photo.is_there(*pixel) && pixel[..3].iter().all(|level| (USABLE[0]..=USABLE[1]).contains(level))
                    {
                        sum.iter_mut().zip(pixel).for_each(|(sum, level)| *sum += linear[usize::from(*level)]);
                        count += 1.0;
                    }
                }
            }
            // The light of what is left of a clipped cell is not that of the cell.
            if count == all {
                let [r, g, b] = sum.map(|sum| sum / count);
                *cell = f32x4::new([r, g, b, 0.0]);
            }
        }
        Ok(Self { side, columns, cells })
    }

    /// Bilinear: red, green and blue. `None` within half a cell of the border, outside, and next to a cell without light.
    fn sample(&self, point: [f64; 2]) -> Option<[f32; 3]> {
        let rows = self.cells.len() / self.columns.max(1);
        let around = Bilinear::at(in_cells(point, [self.side as f64; 2]), self.columns, rows)?;
        let [r, g, b, _] = around.interpolate(&self.cells).to_array();
        (!r.is_nan()).then_some([r, g, b])
    }
}

/// Compares the cells of the first photo with what the second shows of the same places.
fn overlap(
    [a, b]: [usize; 2],
    [first, second]: [&Light; 2],
    photos: &[Photo<'_>],
    alignment: &ManyAlignment,
) -> Option<Overlap> {
    let [there, back] = [[a, b], [b, a]].map(|pair| alignment.geometry.model(pair));
    let (there, back) = (there?, back?);
    let depth = |photo: usize, [x, y]: [f64; 2]| alignment.depth(photo).map_or(0.0, |map| map.sample(x, y));
    let most = RETURN * diagonal(photos[a].image.size());
    let mut ratios = [const { Vec::new() }; 3];
    for (i, own) in first.cells.iter().map(|cell| cell.to_array()).enumerate().filter(|(_, cell)| !cell[0].is_nan()) {
        let middle = |at: usize| (at * first.side) as f64 + 0.5 * (first.side as f64 - 1.0);
        let [x, y] = [middle(i % first.columns), middle(i / first.columns)];
        let Some([u, v]) = there.project(x, y, depth(a, [x, y])) else { continue };
        let Some(other) = second.sample([u, v]) else { continue };
        let Some([p, q]) = back.project(u, v, depth(b, [u, v])) else { continue };
        if (p - x).abs().max((q - y).abs()) <= most {
            for ((ratios, other), own) in ratios.iter_mut().zip(other).zip(own) {
                ratios.push(libm::log(f64::from(other) / f64::from(own)));
            }
        }
    }
    let count = ratios[0].len();
    let [red, green, blue] = ratios.map(median);
    (count >= FEWEST).then_some(Overlap { photos: [a, b], ratio: [red?, green?, blue?], count: count as f64 })
}

/// The gains of least squares over all overlaps, reweighted so that one of something that moved counts little: in no channel, lest it be
/// coloured.
fn solve(photos: usize, reference: usize, overlaps: &[Overlap]) -> Vec<Option<[f64; 3]>> {
    let mut tied = vec![false; photos];
    tied[reference] = true;
    for _ in 0..photos {
        for &Overlap { photos: [a, b], .. } in overlaps {
            let either = tied[a] || tied[b];
            (tied[a], tied[b]) = (either, either);
        }
    }
    // Logarithms.
    let mut gains = vec![[0.0; 3]; photos];
    for _ in 0..ROUNDS {
        let mut equations = [(); 3].map(|()| Equations::zeros(photos));
        for (photo, own) in gains.iter().enumerate() {
            let stay = if photo == reference { FIXED } else { PRIOR };
            for (equations, own) in equations.iter_mut().zip(own) {
                equations.add(photo, photo, stay);
                equations.gradient[photo] += stay * own;
            }
        }
        for &Overlap { photos: [a, b], ratio, count } in overlaps {
            let errors = [0, 1, 2].map(|c| gains[b][c] - gains[a][c] + ratio[c]);
            let size = errors.iter().map(|error| error * error).sum::<f64>().sqrt();
            let weight = count * (NOISE / size.max(NOISE));
            for (equations, error) in equations.iter_mut().zip(errors) {
                equations.add_residual(&[(a, [-1.0, 0.0]), (b, [1.0, 0.0])], [error, 0.0], weight);
            }
        }
        for (c, equations) in equations.into_iter().enumerate() {
            let Some(step) = equations.solve() else { continue };
            gains.iter_mut().zip(step.iter()).for_each(|(own, step)| own[c] += step);
        }
    }
    let gains = gains.into_iter().map(|own| own.map(libm::exp));
    gains.zip(tied).map(|(gains, tied)| tied.then_some(gains)).collect()
}
