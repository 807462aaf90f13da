//! Where the reference, or the mosaic so far, lies on the canvas.

use crate::distance::distance;
use crate::{ImageView, Rect, Result};

/// The reference on the canvas.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub photo: ImageView<'a>,
    /// Canvas position of its top left pixel.
    pub left: usize,
    pub top: usize,
}

impl<'a> Placed<'a> {
    /// What it covers of the canvas.
    pub fn frame(&self) -> Rect {
        Rect { x: self.left, y: self.top, width: self.photo.width(), height: self.photo.height() }
    }

    /// The reference's row in a row of the canvas; `None` above and below it.
    pub fn row(&self, y: usize) -> Option<&'a [[u8; 4]]> {
        let width = self.photo.width();
        let row = y.checked_sub(self.top).filter(|&row| row < self.photo.height())?;
        Some(&self.photo.pixels()[row * width..(row + 1) * width])
    }

    /// Whether a pixel of the reference is one.
    #[inline]
    pub fn is_valid(&self, pixel: [u8; 4]) -> bool {
        self.photo.is_there(pixel)
    }

    /// How far each pixel of the canvas is from where the reference is not, by [`distance`]; `None` where its frame says that.
    pub fn distance_to_border(&self, (width, height): (usize, usize)) -> Result<Option<Vec<u16>>> {
        if !self.photo.is_masked() {
            return Ok(None);
        }
        let outside = |i: usize| self.pixel(self.row(i / width), i % width).is_none();
        distance(width * height, width, &outside).map(Some)
    }

    /// The reference's pixel at a position of the canvas.
    #[inline]
    pub fn pixel(&self, row: Option<&[[u8; 4]]>, x: usize) -> Option<[u8; 4]> {
        row?.get(x.wrapping_sub(self.left)).copied().filter(|&pixel| self.is_valid(pixel))
    }
}
