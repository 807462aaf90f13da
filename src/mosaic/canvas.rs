//! Where the reference lies on the canvas.

use crate::image::check_len;
use crate::warp::Warped;
use crate::{Error, ImageView, Result};

/// The reference on the canvas.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub photo: ImageView<'a>,
    /// Canvas position of its top left pixel.
    pub left: usize,
    pub top: usize,
}

impl<'a> Placed<'a> {
    /// The reference's row in a row of the canvas; `None` above and below it.
    pub fn row(&self, y: usize) -> Option<&'a [[u8; 4]]> {
        let width = self.photo.width();
        let row = y.checked_sub(self.top).filter(|&row| row < self.photo.height())?;
        Some(&self.photo.pixels()[row * width..(row + 1) * width])
    }

    /// The reference's pixel at a position of the canvas.
    #[inline]
    pub fn pixel(&self, row: Option<&[[u8; 4]]>, x: usize) -> Option<[u8; 4]> {
        row?.get(x.wrapping_sub(self.left)).copied()
    }
}

/// Checks that the canvas is whole and that the reference lies inside it at the warped target's offset.
///
/// # Errors
/// `invalid-argument` for an empty canvas; `size-mismatch` when a buffer has not the length its size asks for, or the
/// canvas is too small for the reference (`expected` is then the side it would need, `actual` the side it has).
pub(crate) fn check_canvas(warped: &Warped, reference: ImageView<'_>) -> Result<()> {
    let (image, footprint) = (&warped.image, &warped.footprint);
    check_len("warped", image.data.len(), image.width, image.height, 4)?;
    check_len("footprint", footprint.data.len(), footprint.width, footprint.height, 1)?;
    check_side("footprint width", image.width, footprint.width, footprint.width == image.width)?;
    check_side("footprint height", image.height, footprint.height, footprint.height == image.height)?;
    let right = warped.offset.0.saturating_add(reference.width());
    let bottom = warped.offset.1.saturating_add(reference.height());
    check_side("canvas width", right, image.width, right <= image.width)?;
    check_side("canvas height", bottom, image.height, bottom <= image.height)
}

fn check_side(name: &'static str, expected: usize, actual: usize, fits: bool) -> Result<()> {
    if fits {
        Ok(())
    } else {
        Err(Error::SizeMismatch { name, expected: expected as u64, actual: actual as u64 }.into())
    }
}
