//! Where the reference, or the mosaic so far, lies on the canvas.

use crate::{ImageView, Rect};

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

    /// The reference's pixel at a position of the canvas.
    #[inline]
    pub fn pixel(&self, row: Option<&[[u8; 4]]>, x: usize) -> Option<[u8; 4]> {
        row?.get(x.wrapping_sub(self.left)).copied().filter(|&pixel| self.is_valid(pixel))
    }
}
