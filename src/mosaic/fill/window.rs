//! The part of the picture that filling looks at.

use crate::image::zeroed;
use crate::{Image, Mask, Result};

/// What a pixel is to the filling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Cell {
    /// Transparent, outside the picture, or too far from any void to matter.
    #[default]
    Nothing,
    /// Valid, and within the radius of a void.
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
    pub fn around(voids: &Mask, image: &Image, radius: usize) -> Result<Option<Self>> {
        let Some((left, top, right, bottom)) = bounding_box(voids) else { return Ok(None) };
        let margin = radius + 1;
        let (width, height) = (right - left + 2 * margin, bottom - top + 2 * margin);
        let cells = zeroed(width * height)?;
        let mut window = Self { cells, width, origin: (left, top), margin };
        let rows = || (top..bottom).map(|y| &voids.data[y * voids.width + left..y * voids.width + right]);
        for (y, row) in rows().enumerate() {
            for_each_run(row, |from, to| window.mark_near((from, y), to - from, radius));
        }
        window.drop_transparent(image);
        for (y, row) in rows().enumerate() {
            let at = (y + margin) * width + margin;
            for_each_run(row, |from, to| window.cells[at + from..at + to].fill(Cell::Void));
        }
        Ok(Some(window))
    }

    /// The pixel of the picture under a cell of the window, if there is one.
    pub fn pixel(&self, cell: usize, image: &Image) -> Option<usize> {
        let x = (cell % self.width + self.origin.0).checked_sub(self.margin)?;
        let y = (cell / self.width + self.origin.1).checked_sub(self.margin)?;
        (x < image.width && y < image.height).then(|| y * image.width + x)
    }

    /// Marks all cells within the radius of a run of voids, given by its start in the voids' box and its length.
    fn mark_near(&mut self, (x, y): (usize, usize), length: usize, radius: usize) {
        for row in y + self.margin - radius..=y + self.margin + radius {
            let at = row * self.width + x + self.margin - radius;
            self.cells[at..at + length + 2 * radius].fill(Cell::Known);
        }
    }

    /// Takes the mark off again where there is no valid pixel.
    fn drop_transparent(&mut self, image: &Image) {
        for cell in 0..self.cells.len() {
            if self.cells[cell] == Cell::Known
                && self.pixel(cell, image).is_none_or(|pixel| image.data[4 * pixel + 3] == 0)
            {
                self.cells[cell] = Cell::Nothing;
            }
        }
    }
}

/// Left, top, right and bottom (exclusive) of the set pixels.
fn bounding_box(mask: &Mask) -> Option<(usize, usize, usize, usize)> {
    let set = |row: &[u8]| row.iter().any(|&v| v != 0);
    let mut rows = mask.data.chunks_exact(mask.width);
    let top = rows.clone().position(set)?;
    let bottom = mask.height - rows.clone().rev().position(set)?;
    let (mut left, mut right) = (mask.width, 0);
    for row in rows.by_ref().take(bottom).skip(top) {
        left = row.iter().take(left).position(|&v| v != 0).unwrap_or(left);
        right = right + row[right..].iter().rposition(|&v| v != 0).map_or(0, |i| i + 1);
    }
    Some((left, top, right, bottom))
}

/// Calls `f` with the bounds of every run of set pixels.
fn for_each_run(row: &[u8], mut f: impl FnMut(usize, usize)) {
    let mut x = 0;
    while let Some(from) = row[x..].iter().position(|&v| v != 0).map(|i| x + i) {
        x = row[from..].iter().position(|&v| v == 0).map_or(row.len(), |i| from + i);
        f(from, x);
    }
}
