//! What both photos say about the brightness of the same places.

use crate::image::{defaults, reserve};
use crate::mosaic::canvas::Placed;
use crate::mosaic::span::Span;
use crate::{Image, Result};

/// Cells along the reference's longer side.
const CELLS: usize = 128;
/// Pixels looked at, about, per side of a cell.
const TAPS: usize = 8;
/// Levels outside of which a pixel may be clipped, or too dark to tell.
const USABLE: std::ops::RangeInclusive<u8> = 6..=249;

/// The mean light of both photos over a small cell of the overlap.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Middle of the cell on the canvas.
    pub place: [f32; 2],
    /// Linear light of the target, 0 to 1.
    pub target: [f64; 3],
    /// Linear light of the reference.
    pub reference: [f64; 3],
}

/// Sums over a cell of the target's and the reference's red, green and blue, and how many pixels they are of.
type Sums = [f32; 7];

/// Cells at least half full of pixels that are valid and usable in both photos.
pub(super) fn collect(
    image: &Image,
    reference: &Placed<'_>,
    linear: &[f32; 256],
    span: &mut Span<'_>,
) -> Result<Vec<Sample>> {
    let (width, height) = (reference.photo.width(), reference.photo.height());
    let side = width.max(height).div_ceil(CELLS).max(4);
    let stride = (side / TAPS).max(1);
    let columns = width.div_ceil(side);
    let mut sums: Vec<Sums> = defaults(columns)?;
    let mut samples = Vec::new();
    reserve(&mut samples, columns * height.div_ceil(side))?;
    let pixels = image.data.as_chunks::<4>().0;
    for (j, top) in (0..height).step_by(side).enumerate() {
        span.row(16 * j, 16 * height.div_ceil(side))?;
        sums.fill([0.0; 7]);
        let rows = (top..(top + side).min(height)).step_by(stride);
        let taps = rows.len() * side.div_ceil(stride);
        for y in rows {
            let start = (reference.top + y) * image.width + reference.left;
            let target = pixels[start..start + width].chunks(side);
            let photo = reference.photo.pixels()[y * width..(y + 1) * width].chunks(side);
            for ((target, photo), sums) in target.zip(photo).zip(&mut sums) {
                for (t, r) in target.iter().zip(photo).step_by(stride) {
                    let usable = t[3] != 0 && (0..3).all(|c| USABLE.contains(&t[c]) && USABLE.contains(&r[c]));
                    if usable {
                        for c in 0..3 {
                            sums[c] += linear[usize::from(t[c])];
                            sums[3 + c] += linear[usize::from(r[c])];
                        }
                        sums[6] += 1.0;
                    }
                }
            }
        }
        for (i, sums) in sums.iter().enumerate().filter(|(_, sums)| 2.0 * sums[6] >= taps.max(1) as f32) {
            let middle = |start: usize, offset: usize| (offset + start) as f32 + (side - 1) as f32 / 2.0;
            let place = [middle(i * side, reference.left), middle(top, reference.top)];
            let mut sample = Sample { place, target: [0.0; 3], reference: [0.0; 3] };
            let means = sample.target.iter_mut().chain(&mut sample.reference);
            means.zip(sums).for_each(|(mean, sum)| *mean = f64::from(*sum) / f64::from(sums[6]));
            samples.push(sample);
        }
    }
    Ok(samples)
}
