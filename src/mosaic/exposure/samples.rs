//! What both photos say about the brightness of the same places.

use wide::{f32x4, u8x16};

use crate::image::{reserve, zeroed};
use crate::mosaic::canvas::Placed;
use crate::observer::{Observer, report_row};
use crate::srgb::USABLE;
use crate::{Image, Result, Stage};

/// Cells along the reference's longer side. Tuned on the evaluation cases: flat between 128 and 256.
const CELLS: usize = 128;
/// Pixels looked at, about, per side of a cell. Flat between 4 and 16 on the evaluation cases.
const TAPS: usize = 8;
/// A level that is usable.
const MIDDLE: u8 = 128;

/// The mean light of both photos over a small cell of the overlap.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Middle of the cell on the canvas.
    pub place: [f32; 2],
    /// Linear light of the target, 0 to 1; and 1.
    pub target: [f64; 4],
    /// Linear light of the reference.
    pub reference: [f64; 4],
}

/// Sums over a cell of the target's and the reference's red, green, blue and 1.
type Sums = [f32x4; 2];

/// Cells at least half full of pixels that are valid and usable in both photos.
pub(super) fn collect(
    image: &Image,
    reference: &Placed<'_>,
    linear: &[f32; 256],
    observer: &mut dyn Observer,
) -> Result<Vec<Sample>> {
    let (width, height) = reference.photo.size();
    let side = width.max(height).div_ceil(CELLS).max(4);
    let stride = (side / TAPS).max(1);
    let columns = width.div_ceil(side);
    let mut sums: Vec<Sums> = zeroed(columns)?;
    let [least, most] = USABLE.map(u8x16::splat);
    let mut samples = Vec::new();
    reserve(&mut samples, columns * height.div_ceil(side))?;
    let pixels = image.pixels();
    for (j, top) in (0..height).step_by(side).enumerate() {
        report_row(observer, Stage::Blend, 16 * j, 16 * height.div_ceil(side))?;
        sums.fill(Sums::default());
        let rows = (top..(top + side).min(height)).step_by(stride);
        let taps = rows.len() * side.div_ceil(stride);
        for y in rows {
            let start = (reference.top + y) * image.width() + reference.left;
            let target = pixels[start..start + width].chunks(side);
            let photo = reference.photo.pixels()[y * width..(y + 1) * width].chunks(side);
            for ((target, photo), sums) in target.zip(photo).zip(&mut sums) {
                for (t, r) in target.iter().zip(photo).step_by(stride) {
                    let levels: u8x16 = bytemuck::cast([*t, *r, [MIDDLE; 4], [MIDDLE; 4]]);
                    let usable = levels.max(least).cmp_eq(levels) & levels.min(most).cmp_eq(levels);
                    // Whatever alpha is.
                    if t[3] != 0 && reference.is_valid(*r) && usable.move_mask() | 0b1000_1000 == 0xffff {
                        let [t, r] = [t, r].map(|p| {
                            let light = |c: usize| linear[usize::from(p[c])];
                            f32x4::new([light(0), light(1), light(2), 1.0])
                        });
                        *sums = [sums[0] + t, sums[1] + r];
                    }
                }
            }
        }
        for (i, sums) in sums.iter().enumerate() {
            let [target, other] = sums.map(f32x4::to_array);
            if 2.0 * target[3] < taps.max(1) as f32 {
                continue;
            }
            let middle = |start: usize, offset: usize| (offset + start) as f32 + (side - 1) as f32 / 2.0;
            let place = [middle(i * side, reference.left), middle(top, reference.top)];
            let mean = |sum: f32| f64::from(sum) / f64::from(target[3]);
            samples.push(Sample { place, target: target.map(mean), reference: other.map(mean) });
        }
    }
    Ok(samples)
}
