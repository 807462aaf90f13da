//! How much there is to see around a place: a step is seen in a sky, and not in foliage.

use std::ops::Range;

use wide::f32x4;

use super::BOTH;
use super::cost::levels;
use crate::image::zeroed;
use crate::mosaic::canvas::Placed;
use crate::{Image, Mask, Result};

/// Side in pixels of the blocks that are told apart.
const BLOCK: usize = 16;
/// A mean change between neighbouring pixels, over three channels, at which a step counts half.
const USUAL: f32 = 80.0;
/// A step counts for a quarter at least.
const MOST: f32 = 64.0;

/// Of every block, what the costs there are divided by.
pub(super) struct Texture {
    /// Times 16.
    excuses: Vec<i32>,
    columns: usize,
}

impl Texture {
    /// Of a window of the canvas. What just one photo has is no excuse.
    pub fn of(
        image: &Image,
        reference: &Placed<'_>,
        seam: &Mask,
        (columns, rows): (Range<usize>, Range<usize>),
    ) -> Result<Self> {
        let (width, height) = (columns.len().div_ceil(BLOCK), rows.len().div_ceil(BLOCK));
        // Changes of the target, of the reference, and their number.
        let mut sums: Vec<f32x4> = zeroed(width * height)?;
        let pixels = image.pixels();
        for (j, y) in rows.clone().enumerate().skip(1).step_by(2) {
            let (photo, above) = (reference.row(y), reference.row(y - 1));
            let at = y * seam.width() + columns.start;
            for (i, x) in columns.clone().enumerate().skip(1) {
                let at = at + i;
                if [at, at - 1, at - seam.width()].iter().any(|&at| seam.data()[at] != BOTH) {
                    continue;
                }
                let change = |here: [u8; 4], left: [u8; 4], above: [u8; 4]| {
                    let here = levels(here);
                    ((here - levels(left)).abs() + (here - levels(above)).abs()).reduce_add() as f32
                };
                let other = |row: Option<&[[u8; 4]]>, x: usize| reference.pixel(row, x).unwrap_or_default();
                let target = change(pixels[at], pixels[at - 1], pixels[at - seam.width()]);
                let reference = change(other(photo, x), other(photo, x - 1), other(above, x));
                sums[j / BLOCK * width + i / BLOCK] += f32x4::new([target, reference, 1.0, 0.0]);
            }
        }
        let mut excuses = zeroed(width * height)?;
        for (at, excuse) in excuses.iter_mut().enumerate() {
            let (x, y) = (at % width, at / width);
            let mut sum = f32x4::ZERO;
            for j in y.saturating_sub(1)..(y + 2).min(height) {
                for i in x.saturating_sub(1)..(x + 2).min(width) {
                    sum += sums[j * width + i];
                }
            }
            let [target, reference, count, _] = sum.to_array();
            let change = target.min(reference) / (2.0 * count.max(1.0));
            *excuse = (16.0 + 16.0 * change / USUAL).min(MOST) as i32;
        }
        Ok(Self { excuses, columns: width })
    }

    /// At a place of the window: what 16 times a cost is to be divided by.
    #[inline(always)]
    pub fn excuse(&self, x: usize, y: usize) -> i32 {
        self.excuses[y / BLOCK * self.columns + x / BLOCK]
    }
}
