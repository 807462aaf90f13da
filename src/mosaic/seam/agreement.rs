//! What it costs to pass from one photo to the other at a pixel.

use super::level::Level;
use super::{BOTH, COARSEST};
use crate::image::zeroed;
use crate::mosaic::canvas::Placed;
use crate::mosaic::crop::bounding_box;
use crate::mosaic::span::Span;
use crate::{Image, Mask, Result};

/// What a pixel that the alignment does not vouch for costs on top.
const UNTRUSTED: u16 = 60;

/// The level of the canvas' pixels around where both photos are valid; `None` where they nowhere are.
pub(super) fn finest(
    image: &Image,
    reference: &Placed<'_>,
    trusted: Option<&Mask>,
    seam: &Mask,
    span: &mut Span<'_>,
) -> Result<Option<Level>> {
    let free = seam.data.iter().filter(|&&side| side == BOTH).count();
    // Two cells of the coarsest grid around what is to be decided: the cut is between what lies there.
    let margin = 2 << (free / COARSEST).max(1).ilog2().div_ceil(2);
    let size = (seam.width, seam.height);
    let Some(overlap) = bounding_box(size, &|i| seam.data[i] == BOTH) else { return Ok(None) };
    let (columns, rows) = overlap.grown(margin, size).ranges();
    let mut level = Level::empty(columns.start, rows.start, columns.len(), rows.len())?;
    let (mut above, mut here) = (zeroed(columns.len())?, zeroed(columns.len())?);
    for (j, y) in rows.clone().enumerate() {
        span.row(j, rows.len())?;
        let start = y * seam.width;
        let range = start + columns.start..start + columns.end;
        let target = &image.data.as_chunks::<4>().0[range.clone()];
        let photo = reference.row(y);
        for (((out, target), x), &side) in
            here.iter_mut().zip(target).zip(columns.clone()).zip(&seam.data[range.clone()])
        {
            let other = reference.pixel(photo, x).filter(|_| side == BOTH);
            *out = other.map_or(Difference::default(), |other| Difference::between(*target, other));
        }
        let cells = j * columns.len()..(j + 1) * columns.len();
        level.sides[cells.clone()].copy_from_slice(&seam.data[range]);
        costs(&above, &here, &mut level.costs[cells.clone()]);
        if let Some(trusted) = trusted.filter(|_| photo.is_some()) {
            let believed = &trusted.data[(y - reference.top) * trusted.width..][..trusted.width];
            for (cost, x) in level.costs[cells].iter_mut().zip(columns.clone()) {
                if believed.get(x.wrapping_sub(reference.left)) == Some(&0) {
                    *cost += UNTRUSTED;
                }
            }
        }
        std::mem::swap(&mut above, &mut here);
    }
    Ok(Some(level))
}

/// Target minus reference, in levels.
#[derive(Clone, Copy, Default)]
struct Difference {
    rgb: [i16; 3],
    valid: bool,
}

impl Difference {
    fn between(target: [u8; 4], reference: [u8; 4]) -> Self {
        Self { rgb: [0, 1, 2].map(|c| i16::from(target[c]) - i16::from(reference[c])), valid: true }
    }

    /// Sum over the channels of the absolute differences.
    fn size(&self) -> u16 {
        self.rgb.iter().map(|v| v.unsigned_abs()).sum()
    }

    /// How much the photos' gradients differ towards a neighbour.
    fn change(&self, other: &Self) -> u16 {
        if !(self.valid && other.valid) {
            return 0;
        }
        self.rgb.iter().zip(&other.rgb).map(|(a, b)| a.abs_diff(*b)).sum()
    }
}

/// Cost of a row of pixels: the difference in colour, and that in gradient towards the neighbours to the left and above.
fn costs(above: &[Difference], here: &[Difference], out: &mut [u16]) {
    let mut left = Difference::default();
    for ((here, above), cost) in here.iter().zip(above).zip(out) {
        *cost = 2 * here.size() + here.change(&left) + here.change(above);
        left = *here;
    }
}
