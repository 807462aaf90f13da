//! Which void is filled how: by its width.

use super::super::distance::{STRAIGHT, distance};
use crate::image::reserve;
use crate::{Image, Mask, Result};

/// What becomes of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Not to be filled, whatever it is.
    Other,
    /// In a gap so narrow that there is nothing to invent.
    Gap,
    /// In a void.
    Void,
    /// In a void too wide for anything invented to be believed.
    Wide,
}

/// Half the width in pixels up to which a void is a gap.
const GAP: u32 = 2;

/// What becomes of every pixel, and how far it is from the nearest one to go by. `widest` is half the width in pixels of
/// the widest void to be filled.
pub(super) fn parts(image: &Image, voids: &Mask, widest: u32) -> Result<(Vec<Part>, Vec<u32>)> {
    let cells = voids.data.len();
    let pixels = image.data.as_chunks::<4>().0;
    let inwards = distance(cells, image.width, &|i| voids.data[i] == 0 && pixels[i][3] != 0)?;
    let mut parts = Vec::new();
    reserve(&mut parts, cells)?;
    parts.extend(voids.data.iter().map(|&void| if void != 0 { Part::Gap } else { Part::Other }));
    // Where a disc of that radius has room, and half as much around, so that corners are not cut off.
    for (radius, name) in [(GAP, Part::Void), (widest, Part::Wide)] {
        let reach = STRAIGHT * radius;
        let is_core = |i: usize| voids.data[i] != 0 && inwards[i] > reach;
        if !(0..cells).any(is_core) {
            break;
        }
        let outwards = distance(cells, image.width, &is_core)?;
        for (part, _) in parts.iter_mut().zip(outwards).filter(|(_, outwards)| *outwards <= reach + reach / 2) {
            *part = if *part == Part::Other { Part::Other } else { name };
        }
    }
    Ok((parts, inwards))
}
