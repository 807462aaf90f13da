//! Which void is filled how: by its width.

use super::super::crop::Rect;
use super::super::distance::{STRAIGHT, distance};
use super::cluster::TILE;
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

/// What becomes of the pixels of a window, some tiles of the picture, that holds all voids. Row by row.
pub(super) struct Parts {
    pub window: Rect,
    pub parts: Vec<Part>,
    /// How far each pixel is from the nearest one to go by, if that is not farther than half the widest void.
    pub inwards: Vec<u16>,
}

impl Parts {
    /// `bounds` is around all voids, `widest` half the width in pixels of the widest one to be filled.
    pub fn of(image: &Image, voids: &Mask, bounds: Rect, widest: u32) -> Result<Self> {
        let window = bounds.grown(widest.max(GAP) as usize, (image.width, image.height));
        let window = window.tiled(TILE, (image.width, image.height));
        let cells = window.width * window.height;
        let (mut parts, mut known) = (Vec::new(), Vec::new());
        reserve(&mut parts, cells)?;
        reserve(&mut known, cells)?;
        for (voids, pixels) in window.of(&voids.data, image.width).zip(window.of(image.data.as_chunks().0, image.width)) {
            parts.extend(voids.iter().map(|&void| if void != 0 { Part::Gap } else { Part::Other }));
            known.extend(voids.iter().zip(pixels).map(|(&void, pixel): (_, &[u8; 4])| void == 0 && pixel[3] != 0));
        }
        let inwards = distance(known.into_iter(), window.width)?;
        // Where a disc of that radius has room, and half as much around, so that corners are not cut off.
        for (radius, name) in [(GAP, Part::Void), (widest, Part::Wide)] {
            let reach = (STRAIGHT * radius).min(u32::from(u16::MAX) - 1);
            let is_core = |(&part, &inwards): (&Part, &u16)| part != Part::Other && u32::from(inwards) > reach;
            if !parts.iter().zip(&inwards).any(is_core) {
                break;
            }
            let outwards = distance(parts.iter().zip(&inwards).map(is_core), window.width)?;
            for (part, outwards) in parts.iter_mut().zip(outwards) {
                if *part != Part::Other && u32::from(outwards) <= reach + reach / 2 {
                    *part = name;
                }
            }
        }
        Ok(Self { window, parts, inwards })
    }

    /// The part that a pixel of the window is.
    pub fn at(&self, x: usize, y: usize) -> Part {
        self.parts[(y - self.window.y) * self.window.width + x - self.window.x]
    }
}
