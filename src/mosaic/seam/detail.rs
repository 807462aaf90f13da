//! Which of two photos is sharper: the other one was out of focus or shaken, or is enlarged.

use super::BOTH;
use crate::image::reserve;
use crate::luma::rec601_level;
use crate::mosaic::canvas::Placed;
use crate::{Image, Mask, Result};

/// Pixels along a block, whose mean is looked at: what is finer is noise where a dark photo was brightened.
const BLOCK: usize = 2;
/// Fewer blocks say nothing.
const FEWEST: u64 = 500;
/// A change of so many levels from block to block is no detail.
const FLOOR: f64 = 1.0;
/// Data cost of a pixel for each octave of less detail, the part of one that makes no difference, and the most that counts. With less that makes none,
/// photos that are as sharp to the eye change places, and steps are a quarter more in two of ten sets.
const OCTAVE: f64 = 250.0;
const ALIKE: f64 = 0.45;
const MOST: f64 = 1.0;

/// What it costs to show the target rather than each of the photos that the reference, a mosaic itself, is made of.
pub(super) struct Detail {
    costs: Vec<i16>,
}

impl Detail {
    /// Of the warped target and the reference, where `seam` says that both are valid; `labels` say which photo the reference shows.
    ///
    /// Each photo is judged by all of the overlap: place by place, one that shows something else there would win with it.
    pub fn of(image: &Image, reference: &Placed<'_>, seam: &Mask, labels: &Mask) -> Result<Self> {
        let (columns, rows) = (seam.width() / BLOCK, seam.height() / BLOCK);
        let mut blocks = Vec::new();
        reserve(&mut blocks, columns * rows)?;
        blocks.extend((0..columns * rows).map(|at| block(image, reference, seam, [at % columns, at / columns])));
        // By label: how much the target and the reference change from block to block, and how many changes that is.
        let mut sums = [[0u64; 3]; 256];
        for (at, here) in blocks.iter().enumerate() {
            let Some(here) = here else { continue };
            let (x, y) = (at % columns, at / columns);
            let label = labels.data()[(y * labels.width() + x) * BLOCK];
            let [target, reference, count] = &mut sums[usize::from(label)];
            let right = blocks.get(at + 1).filter(|_| x + 1 < columns);
            for next in [right, blocks.get(at + columns)].into_iter().flatten().flatten() {
                *target += u64::from(here[0].abs_diff(next[0]));
                *reference += u64::from(here[1].abs_diff(next[1]));
                *count += 1;
            }
        }
        let cost = |[target, reference, count]: [u64; 3]| {
            if count < FEWEST {
                return 0;
            }
            let floor = FLOOR * (BLOCK * BLOCK) as f64 * count as f64;
            let octaves = libm::log2((reference as f64 + floor) / (target as f64 + floor));
            (OCTAVE * (octaves.abs() - ALIKE).clamp(0.0, MOST)).copysign(octaves) as i16
        };
        Ok(Self { costs: sums.into_iter().map(cost).collect() })
    }

    /// The cost at a pixel where the reference shows this photo; less than 0 if the target is sharper.
    pub fn cost(&self, label: u8) -> i16 {
        self.costs[usize::from(label)]
    }
}

/// How bright the target and the reference are on a block, summed over it; `None` unless both are valid all over it.
fn block(image: &Image, reference: &Placed<'_>, seam: &Mask, at: [usize; 2]) -> Option<[u16; 2]> {
    let [left, top] = at.map(|v| v * BLOCK);
    let mut sums = [0; 2];
    for y in top..top + BLOCK {
        let row = reference.row(y);
        for x in left..left + BLOCK {
            let pixel = Some(y * seam.width() + x).filter(|at| seam.data()[*at] == BOTH).map(|at| image.pixels()[at]);
            sums[0] += u16::from(rec601_level(pixel?));
            sums[1] += u16::from(rec601_level(reference.pixel(row, x)?));
        }
    }
    Some(sums)
}
