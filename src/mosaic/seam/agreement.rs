//! What it costs to pass from one photo to the other at a pixel.

use super::level::Level;
use super::{BOTH, COARSEST};
use crate::image::defaults;
use crate::mosaic::canvas::Placed;
use crate::mosaic::crop::{bounding_box, extent};
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
    let overlap = |y: usize| extent(seam.data[y * seam.width..(y + 1) * seam.width].iter().map(|&side| side == BOTH));
    let Some(overlap) = bounding_box(size.1, &overlap) else { return Ok(None) };
    let (columns, rows) = overlap.grown(margin, size).ranges();
    let mut level = Level::empty(columns.start, rows.start, columns.len(), rows.len())?;
    let mut above: Vec<Option<Difference>> = defaults(columns.len())?;
    let pixels = image.data.as_chunks::<4>().0;
    for (j, y) in rows.clone().enumerate() {
        span.row(j, rows.len())?;
        let photo = reference.row(y);
        let mut left = None;
        for ((i, x), above) in columns.clone().enumerate().zip(&mut above) {
            let (cell, at) = (j * columns.len() + i, y * seam.width + x);
            let side = seam.data[at];
            level.cells[cell].side = side;
            let other = reference.pixel(photo, x).filter(|_| side == BOTH);
            let here = other.map(|other| [0, 1, 2].map(|c| i16::from(pixels[at][c]) - i16::from(other[c])));
            if let Some(here) = here {
                // The difference in colour, and that in gradient towards the neighbours to the left and above.
                let gradients = change(here, left.unwrap_or(here)) + change(here, above.unwrap_or(here));
                let place = (y - reference.top) * reference.photo.width() + x - reference.left;
                let believed = trusted.is_none_or(|trusted| trusted.data[place] != 0);
                level.cells[cell].cost = 2 * change(here, [0; 3]) + gradients + if believed { 0 } else { UNTRUSTED };
            }
            (left, *above) = (here, here);
        }
    }
    Ok(Some(level))
}

/// Target minus reference, in levels.
type Difference = [i16; 3];

/// Sum over the channels of how much two differences differ.
fn change(a: Difference, b: Difference) -> u16 {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(b)).sum()
}
