//! The part of the picture that filling looks at.

use std::ops::Range;

use super::super::super::crop::{Rect, bounding_box};
use crate::image::defaults;
use crate::{Image, Mask, Result};

/// What a pixel is to the filling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Cell {
    /// Too far from any void to matter.
    #[default]
    Far,
    /// Within the radius of a void, but transparent or outside the picture.
    Near,
    /// Within the radius of a void, and valid.
    Known,
    /// To be filled.
    Void,
}

/// The bounding box of all voids with a margin of one pixel more than the radius, which may reach beyond the picture:
/// so no void's neighbourhood leaves it, nor does any neighbour of a pixel in such a neighbourhood.
pub(super) struct Window {
    /// Row by row, `width` a row.
    pub cells: Vec<Cell>,
    pub width: usize,
    /// Position in the picture of the first cell that is not margin, and the margin.
    pub origin: (usize, usize),
    pub margin: usize,
}

impl Window {
    /// `None` when there are no voids.
    pub fn around(voids: &Mask, unknown: &Mask, image: &Image, radius: usize) -> Result<Option<Self>> {
        let Some(bounds) = bounding_box(&voids.data, voids.width, |&void| void != 0) else { return Ok(None) };
        let Rect { x: left, y: top, .. } = bounds;
        let (right, bottom) = (left + bounds.width, top + bounds.height);
        let margin = radius + 1;
        let (width, height) = (bounds.width + 2 * margin, bounds.height + 2 * margin);
        let cells = defaults(width * height)?;
        let mut window = Self { cells, width, origin: (left, top), margin };
        let rows = || (top..bottom).map(|y| &voids.data[y * voids.width + left..y * voids.width + right]);
        for (y, row) in rows().enumerate() {
            for_each_run(row, |from, to| window.mark_near((from, y), to - from, radius));
        }
        for (cells, pixels) in window.rows(image) {
            let unknown = &unknown.data[pixels.clone()];
            let pixels = image.data[4 * pixels.start..4 * pixels.end].as_chunks::<4>().0;
            for ((cell, pixel), &unknown) in window.cells[cells].iter_mut().zip(pixels).zip(unknown) {
                *cell = if *cell == Cell::Near && pixel[3] != 0 && unknown == 0 { Cell::Known } else { *cell };
            }
        }
        for (y, row) in rows().enumerate() {
            let at = (y + margin) * width + margin;
            for_each_run(row, |from, to| window.cells[at + from..at + to].fill(Cell::Void));
        }
        Ok(Some(window))
    }

    /// The rows of the window that the picture is under: range of the cells, range of the pixels.
    pub fn rows(&self, image: &Image) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + use<> {
        let Self { width, origin: (left, top), margin, .. } = *self;
        let picture = image.width;
        let (x0, y0) = (margin.saturating_sub(left), margin.saturating_sub(top));
        let x1 = width.min(image.width + margin - left);
        let y1 = (self.cells.len() / width).min(image.height + margin - top);
        (y0..y1).map(move |y| {
            let pixel = (y + top - margin) * picture + x0 + left - margin;
            (y * width + x0..y * width + x1, pixel..pixel + x1 - x0)
        })
    }

    /// The pixel of the picture under a cell that is not margin.
    pub fn pixel(&self, cell: usize, image: &Image) -> usize {
        let (x, y) = (cell % self.width, cell / self.width);
        (y + self.origin.1 - self.margin) * image.width + x + self.origin.0 - self.margin
    }

    /// Marks all cells within the radius of a run of voids, given by its start in the voids' box and its length.
    fn mark_near(&mut self, (x, y): (usize, usize), length: usize, radius: usize) {
        for row in y + self.margin - radius..=y + self.margin + radius {
            let at = row * self.width + x + self.margin - radius;
            self.cells[at..at + length + 2 * radius].fill(Cell::Near);
        }
    }
}

/// Calls `f` with the bounds of every run of set pixels.
fn for_each_run(row: &[u8], mut f: impl FnMut(usize, usize)) {
    let mut x = 0;
    while let Some(from) = row[x..].iter().position(|&v| v != 0).map(|i| x + i) {
        x = row[from..].iter().position(|&v| v == 0).map_or(row.len(), |i| from + i);
        f(from, x);
    }
}
