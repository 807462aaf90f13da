//! Where the seam runs.

use super::{inside, share};
use crate::image::check_size;
use crate::warp::Warped;
use crate::{Mask, Rect, Result};

/// Within so many pixels of the reference's border a seam is on it.
const NEAR: i64 = 3;

/// Whether a seam passes between two neighbouring pixels of these labels, which say which photo shows: 0 for none.
pub(super) fn crosses(a: u8, b: u8) -> bool {
    a != b && a != 0 && b != 0
}

/// The seam's place and length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeamShape {
    /// Share of the seam on the reference's border, where it had nowhere else to go; `None` without a seam.
    pub on_border: Option<f64>,
    /// Its pixels over the square root of the overlap's: islands and zigzags make it long.
    pub length: f64,
}

/// Of the labels `seam` (1 where the target shows, 2 the reference) on a canvas with the reference at `frame`.
///
/// # Errors
/// `size-mismatch` when masks, seam or frame do not fit the canvas.
pub fn seam_shape(warped: &Warped, seam: &Mask, frame: Rect) -> Result<SeamShape> {
    warped.check_frame(frame)?;
    check_size("seam", seam.size(), warped.image.size())?;
    let (width, height) = seam.size();
    let (mut length, mut on_border, mut overlap) = (0, 0, 0);
    for (i, &label) in seam.data().iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let inside = inside(frame, x, y);
        overlap += usize::from(inside >= 0 && warped.footprint.data()[i] != 0);
        let right = x + 1 < width && crosses(label, seam.data()[i + 1]);
        let below = y + 1 < height && crosses(label, seam.data()[i + width]);
        if right || below {
            length += 1;
            on_border += usize::from(inside.abs() <= NEAR);
        }
    }
    Ok(SeamShape {
        on_border: (length > 0).then(|| share(on_border, length)),
        length: length as f64 / (overlap.max(1) as f64).sqrt(),
    })
}
