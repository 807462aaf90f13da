//! How each void is filled, depending on its width.

use super::{FillMethod, FillOptions};
use crate::distance::{FAR, STRAIGHT, distance_up_to};
use crate::image::{reserve, reserve_more};
use crate::rect::Rect;
use crate::{Image, Mask, Result};

/// Side in pixels of the tiles that voids are grouped by: voids in tiles that touch belong together.
pub(super) const TILE: usize = 32;

/// How a pixel is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub(super) enum Part {
    /// Valid: a source.
    Known,
    /// Empty, and not to be filled.
    Empty,
    /// It is filled smoothly.
    Gap,
    /// It is filled with a piece of the background.
    Void,
    /// Part of a void too wide to be filled plausibly.
    Wide,
}

/// Half the width in pixels up to which a void is filled smoothly.
const NARROW: usize = 2;

/// What becomes of the pixels of a window, some tiles of the picture, that holds all voids. Row by row.
pub(super) struct Parts {
    pub window: Rect,
    pub parts: Vec<Part>,
    /// How far they are from the nearest one to go by, if that is not farther than half the widest void to be filled. Nothing
    /// when all are filled smoothly.
    pub inwards: Vec<u16>,
}

impl Parts {
    /// Of the voids inside of `bounds`.
    pub fn of(image: &Image, voids: &Mask, bounds: Rect, options: &FillOptions) -> Result<Self> {
        let size = image.size();
        let pixels = image.pixels();
        let mut widest = NARROW;
        if options.method == FillMethod::Exemplar {
            let valid = pixels.iter().filter(|pixel| pixel[3] != 0).count();
            widest = (options.max_width * (valid as f64).sqrt() / 2.0) as usize;
        }
        let window = bounds.grown(widest.max(NARROW), size).tiled(TILE, size);
        let (width, cells) = (window.width, window.width * window.height);
        let mut parts = Vec::new();
        reserve(&mut parts, cells)?;
        for y in window.y..window.y + window.height {
            let row = y * image.width() + window.x..y * image.width() + window.x + width;
            parts.extend(voids.data()[row.clone()].iter().zip(&pixels[row]).map(|(&void, pixel)| {
                match (void, pixel[3]) {
                    (0, 0) => Part::Empty,
                    (0, _) => Part::Known,
                    _ => Part::Gap,
                }
            }));
        }
        if options.method == FillMethod::Smooth {
            return Ok(Self { window, parts, inwards: Vec::new() });
        }
        let most = |pixels: usize| (STRAIGHT as usize * pixels).min(usize::from(FAR) - 1) as u16;
        let inwards = distance_up_to(most(widest.max(NARROW)), cells, width, &|i| parts[i] == Part::Known)?;
        // Where a disc of that radius has room, and half as much around, so that corners are not cut off.
        for (radius, name) in [(NARROW, Part::Void), (widest.max(NARROW), Part::Wide)] {
            let reach = most(radius);
            let is_core = |i: usize| parts[i] >= Part::Gap && inwards[i] > reach;
            if !(0..cells).any(is_core) {
                break;
            }
            let outwards = distance_up_to(reach.saturating_add(reach / 2), cells, width, &is_core)?;
            for (part, outwards) in parts.iter_mut().zip(outwards) {
                if *part >= Part::Gap && outwards != FAR {
                    *part = name;
                }
            }
        }
        Ok(Self { window, parts, inwards })
    }

    /// The gaps, counted row by row of a picture `width` wide.
    pub fn gaps(&self, width: usize) -> Result<Vec<usize>> {
        let mut gaps = Vec::new();
        for (at, _) in self.parts.iter().enumerate().filter(|(_, part)| **part == Part::Gap) {
            reserve_more(&mut gaps, 1)?;
            gaps.push((self.window.y + at / self.window.width) * width + self.window.x + at % self.window.width);
        }
        Ok(gaps)
    }
}
