//! Average blending with masks.

use crate::warp::Warped;
use crate::{Image, ImageView, Mask, Result};

/// The two photos on one canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Mosaic {
    /// RGBA, alpha 255 where either photo is valid, 0 elsewhere.
    pub image: Image,
    /// Pixels inside the warped target's footprint that neither photo covers.
    pub voids: Mask,
}

/// Average of the two where both are valid, the valid one elsewhere.
///
/// # Errors
/// `size-mismatch` when the reference does not fit the canvas, `out-of-memory`.
pub fn blend(_warped: &Warped, _reference: ImageView<'_>) -> Result<Mosaic> {
    unimplemented!()
}
