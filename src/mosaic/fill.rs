//! Filling of the mosaic's inner voids.

use crate::observer::Observer;
use crate::{Image, Mask, Result};

/// Options of [`fill`].
#[derive(Debug, Clone, PartialEq)]
pub struct FillOptions {
    /// Radius in pixels of the neighbourhood a filled pixel is drawn from.
    pub radius: u32,
}

impl Default for FillOptions {
    fn default() -> Self {
        Self { radius: 5 }
    }
}

/// Fills the pixels of `voids`, from their borders inwards, and makes them opaque.
///
/// # Errors
/// `size-mismatch`, `invalid-argument`, `out-of-memory`, `aborted`.
pub fn fill(_image: &mut Image, _voids: &Mask, _options: &FillOptions, _observer: &mut dyn Observer) -> Result<()> {
    unimplemented!()
}
