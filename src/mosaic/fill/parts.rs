//! Which void is filled how: by its width.

use super::super::crop::Rect;
use super::cluster::Cluster;
use super::distance::{STRAIGHT, spread, starts};
use crate::image::defaults;
use crate::{Image, Result};

/// What becomes of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Part {
    /// Not to be filled, whatever it is.
    #[default]
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

/// A cluster's pixels by what becomes of them.
pub(super) struct Parts {
    /// Holds the cluster and the pixels around it.
    window: Rect,
    /// Of every pixel of the window, row by row.
    parts: Vec<Part>,
    /// Half the width in pixels of the widest void.
    pub deepest: u32,
}

impl Parts {
    /// `widest` is half the width in pixels of the widest void to be filled.
    pub fn of(cluster: &Cluster<'_>, image: &Image, widest: u32) -> Result<Self> {
        let window = grown(cluster.bounds, 1, image);
        let place = |cell: usize| (window.x + cell % window.width, window.y + cell / window.width);
        let cells = window.width * window.height;
        let mut inwards = starts(cells, |cell| {
            let (x, y) = place(cell);
            !cluster.is_void(x, y) && image.data[4 * (y * image.width + x) + 3] != 0
        })?;
        spread(&mut inwards, window.width);
        let mut parts: Vec<Part> = defaults(cells)?;
        for (cell, part) in parts.iter_mut().enumerate() {
            let (x, y) = place(cell);
            if cluster.contains(x, y) {
                *part = Part::Gap;
            }
        }
        // Where a disc of that radius has room, and half as much around, so that corners are not cut off.
        for (radius, name) in [(GAP, Part::Void), (widest, Part::Wide)] {
            let reach = STRAIGHT * radius;
            let is_core = |cell: usize| parts[cell] != Part::Other && inwards[cell] > reach;
            if !(0..cells).any(is_core) {
                break;
            }
            let mut outwards = starts(cells, is_core)?;
            spread(&mut outwards, window.width);
            for (part, outwards) in parts.iter_mut().zip(&outwards) {
                if *part != Part::Other && *outwards <= reach + reach / 2 {
                    *part = name;
                }
            }
        }
        let voids = parts.iter().zip(&inwards).filter(|(part, _)| **part == Part::Void);
        let deepest = voids.map(|(_, &distance)| distance).max().unwrap_or(0) / STRAIGHT;
        Ok(Self { window, parts, deepest })
    }

    /// The part of a pixel of the picture.
    pub fn at(&self, x: usize, y: usize) -> Part {
        let (x, y) = (x.wrapping_sub(self.window.x), y.wrapping_sub(self.window.y));
        if x < self.window.width && y < self.window.height {
            self.parts[y * self.window.width + x]
        } else {
            Part::Other
        }
    }

    /// Positions in the picture of all pixels of a part, row by row.
    pub fn positions(&self, part: Part) -> impl Iterator<Item = (usize, usize)> {
        let place = |cell: usize| (self.window.x + cell % self.window.width, self.window.y + cell / self.window.width);
        (0..self.parts.len()).filter(move |&cell| self.parts[cell] == part).map(place)
    }
}

/// The rectangle with so many pixels more on each side, as far as the picture reaches.
pub(super) fn grown(rect: Rect, margin: usize, image: &Image) -> Rect {
    let (x, y) = (rect.x.saturating_sub(margin), rect.y.saturating_sub(margin));
    let right = (rect.x + rect.width + margin).min(image.width);
    let bottom = (rect.y + rect.height + margin).min(image.height);
    Rect { x, y, width: right - x, height: bottom - y }
}
