//! PSNR, SSIM and coverage of the overlap.

use crate::warp::Warped;
use crate::{ImageView, Result};

/// How well the warped target agrees with the reference. Quote PSNR only together with coverage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// PSNR in dB over the overlap's bounding box, both pictures black outside the overlap (the authors' measure).
    pub psnr_bbox: f64,
    /// SSIM over the same box.
    pub ssim_bbox: f64,
    /// PSNR in dB over valid pixels only.
    pub psnr_mask: f64,
    /// SSIM averaged over valid pixels only (its windows see the zeroed surround, as the authors' do).
    pub ssim_mask: f64,
    /// Valid share of the reference, 0 to 1.
    pub coverage: f64,
}

/// Measures the overlap, on the reference's grid. Identical pictures have infinite PSNR.
///
/// # Errors
/// `no-overlap` when no pixel of the reference is covered, `size-mismatch`, `out-of-memory`.
pub fn quality(_warped: &Warped, _reference: ImageView<'_>) -> Result<Quality> {
    unimplemented!()
}
