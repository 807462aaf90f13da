//! PSNR, SSIM and coverage of the overlap, and what a person sees of the mosaic.

mod appearance;
mod ssim;

pub use appearance::{
    Appearance, BrokenLines, LineBreaks, SeamShape, Voids, appearance, bending, broken_lines, seam_shape,
    visible_steps, voids,
};

use crate::rect::{Rect, bounding_box, extent};
use crate::warp::Warped;
use crate::{Error, ImageView, Result};

/// How well the warped target agrees with the reference. Quote PSNR only together with coverage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// PSNR in dB over the overlap's bounding box, both pictures black outside the overlap (the authors' measure).
    pub psnr_bbox: f64,
    /// SSIM over the same box, less the 5 pixels at its border where windows would stick out; a box narrower or
    /// lower than a window (11 pixels) counts whole.
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
/// A pixel of the reference is valid where the warped alpha over it is not 0. SSIM is Wang et al.'s (Gaussian window,
/// σ = 1.5, 11×11; K₁ = 0.01, K₂ = 0.03, population covariance), the mean over red, green and blue.
///
/// # Errors
/// `no-overlap` when no pixel of the reference is covered, `size-mismatch`, `out-of-memory`.
pub fn quality(warped: &Warped, reference: ImageView<'_>) -> Result<Quality> {
    warped.check_canvas(reference)?;
    let whole = Overlap { warped, reference, left: 0, top: 0, width: reference.width(), height: reference.height() };
    let row = |y: usize| extent(whole.row(y).0.iter().map(|pixel| pixel[3] != 0));
    let Rect { x, y, width, height } = bounding_box(reference.height(), row).ok_or(Error::NoOverlap { pixels: 0 })?;
    let overlap = Overlap { left: x, top: y, width, height, ..whole };
    let (mut covered, mut error) = (0u64, 0u64);
    for (target, reference) in overlap.rows() {
        let (pixels, squared) = squared_error(target, reference);
        (covered, error) = (covered + pixels, error + squared);
    }
    let similarity = ssim::similarity(&overlap, covered)?;
    let pixels = |width: usize, height: usize| width as f64 * height as f64;
    Ok(Quality {
        psnr_bbox: psnr(error, pixels(overlap.width, overlap.height)),
        ssim_bbox: similarity.whole,
        psnr_mask: psnr(error, covered as f64),
        ssim_mask: similarity.masked,
        coverage: covered as f64 / pixels(reference.width(), reference.height()),
    })
}

/// A rectangle of the reference, and the canvas over it.
struct Overlap<'a> {
    warped: &'a Warped,
    reference: ImageView<'a>,
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl<'a> Overlap<'a> {
    /// RGBA of the warped target and of the reference in a row of the rectangle.
    fn row(&self, y: usize) -> (&'a [[u8; 4]], &'a [[u8; 4]]) {
        let cut = |data: &'a [u8], stride: usize, x: usize, y: usize| {
            let at = 4 * (y * stride + x);
            data[at..at + 4 * self.width].as_chunks().0
        };
        let (x, y) = (self.left, self.top + y);
        let (image, (dx, dy)) = (&self.warped.image, self.warped.offset);
        (cut(image.data(), image.width(), dx + x, dy + y), cut(self.reference.data(), self.reference.width(), x, y))
    }

    fn rows(&self) -> impl Iterator<Item = (&'a [[u8; 4]], &'a [[u8; 4]])> {
        (0..self.height).map(|y| self.row(y))
    }
}

/// Valid pixels of a row, and the sum of their squared differences over red, green and blue.
fn squared_error(target: &[[u8; 4]], reference: &[[u8; 4]]) -> (u64, u64) {
    let (mut pixels, mut sum) = (0, 0);
    // 4096 pixels at most, so that the sum fits 32 bits: faster, and no row is too long.
    for (target, reference) in target.chunks(4096).zip(reference.chunks(4096)) {
        let (mut valid, mut squared) = (0u32, 0u32);
        for (t, r) in target.iter().zip(reference) {
            let difference = |c: usize| (i32::from(t[c]) - i32::from(r[c])).unsigned_abs();
            let d2 = (0..3).map(|c| difference(c) * difference(c)).sum::<u32>();
            let one = u32::from(t[3] != 0);
            (valid, squared) = (valid + one, squared + one * d2);
        }
        (pixels, sum) = (pixels + u64::from(valid), sum + u64::from(squared));
    }
    (pixels, sum)
}

/// In dB, of a sum of squared differences over three channels of `pixels` pixels.
fn psnr(error: u64, pixels: f64) -> f64 {
    if error == 0 { f64::INFINITY } else { 10.0 * libm::log10(255.0 * 255.0 * 3.0 * pixels / error as f64) }
}
