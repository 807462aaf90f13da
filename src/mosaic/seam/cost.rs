//! Cost of the seam at each pixel: how much the photos differ there in colour and gradient.

use wide::i32x4;

use super::level::Level;
use super::{BOTH, COARSEST};
use crate::image::zeroed;
use crate::mosaic::canvas::Placed;
use crate::mosaic::span::Span;
use crate::rect::{bounding_box, extent};
use crate::{Image, Mask, Result};

/// Extra cost of a pixel whose alignment is not reliable.
const UNRELIABLE: u16 = 60;

/// The level of the canvas' pixels around where both photos are valid; `None` where they nowhere are.
pub(super) fn finest(
    image: &Image,
    reference: &Placed<'_>,
    trusted: Option<&Mask>,
    seam: &Mask,
    span: &mut Span<'_>,
) -> Result<Option<Level>> {
    let free = seam.data().iter().filter(|&&side| side == BOTH).count();
    // Two cells of the coarsest grid around what is to be decided: the cut is between what lies there.
    let margin = 2 << (free / COARSEST).max(1).ilog2().div_ceil(2);
    let size = (seam.width(), seam.height());
    let overlap =
        |y: usize| extent(seam.data()[y * seam.width()..(y + 1) * seam.width()].iter().map(|&side| side == BOTH));
    let Some(overlap) = bounding_box(size.1, overlap) else { return Ok(None) };
    let (columns, rows) = overlap.grown(margin, size).ranges();
    let mut level = Level::empty(columns.start, rows.start, columns.len(), rows.len())?;
    let mut above: Vec<Difference> = zeroed(columns.len())?;
    let pixels = image.pixels();
    for (j, y) in rows.clone().enumerate() {
        span.row(j, rows.len())?;
        let photo = reference.row(y);
        let mut left = Difference::default();
        let cells = &mut level.cells[j * columns.len()..(j + 1) * columns.len()];
        for ((x, above), cell) in columns.clone().zip(&mut above).zip(cells) {
            let at = y * seam.width() + x;
            cell.side = seam.data()[at];
            let mut here = Difference::default();
            if let Some(other) = reference.pixel(photo, x).filter(|_| cell.side == BOTH) {
                here = [(levels(pixels[at]) - levels(other)), i32x4::splat(-1)];
                // The difference in colour, and that in gradient towards the neighbours to the left and above.
                let change = |from: Difference| (here[0] - from[0]).abs() & from[1];
                let sum = here[0].abs() + here[0].abs() + change(left) + change(*above);
                let place = (y - reference.top) * reference.photo.width() + x - reference.left;
                let reliable = trusted.is_none_or(|trusted| trusted.data()[place] != 0);
                cell.cost = sum.reduce_add() as u16 + if reliable { 0 } else { UNRELIABLE };
            }
            (left, *above) = (here, here);
        }
    }
    Ok(Some(level))
}

/// Target minus reference, in levels, and all ones; zeros where it is not known.
type Difference = [i32x4; 2];

/// Red, green, blue, 0.
fn levels([r, g, b, _]: [u8; 4]) -> i32x4 {
    i32x4::new([r, g, b, 0].map(i32::from))
}
