//! PSNR, SSIM and coverage of the overlap, and what a person sees of the mosaic.

mod appearance;
mod ssim;

pub use appearance::{
    Appearance, BrokenLines, LineBreaks, SeamShape, VisibleSteps, Voids, appearance, bending, broken_lines, seam_shape,
    visible_steps, voids,
};

use crate::mosaic::{check_gains, gain_table};
use crate::rect::{Rect, bounding_box, extent};
use crate::warp::{RELIABLE, Warped};
use crate::{Error, Image, ImageView, Result};

/// How well the warped target agrees with the reference. Quote PSNR only together with coverage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// PSNR in dB over the overlap's bounding box, both images black outside the overlap (the authors' measure).
    pub psnr_bbox: f64,
    /// SSIM over the same box, less the 5 pixels at its border where the window would not fit; a box narrower or
    /// lower than a window (11 pixels) counts as a whole.
    pub ssim_bbox: f64,
    /// PSNR in dB over valid pixels only.
    pub psnr_mask: f64,
    /// SSIM averaged over valid pixels only (its windows see the zeroed surround, as the authors' do).
    pub ssim_mask: f64,
    /// Valid share of the reference, or of what is there of it, 0 to 1.
    pub coverage: f64,
}

/// Measures the overlap, on the reference's grid, after multiplying the target's linear light by those of the `gains` of red,
/// green and blue that bring it nearer to the reference; with gains of 1 it is taken as it is. Identical pictures have infinite PSNR.
///
/// A pixel of the reference is valid where it is not masked, the warped alpha over it is not 0 and the confidence, if there is one, at
/// least [`RELIABLE`]. SSIM is Wang et al.'s (Gaussian window,
/// σ = 1.5, 11×11; K₁ = 0.01, K₂ = 0.03, population covariance), the mean over red, green and blue.
///
/// # Errors
/// `invalid-argument` for gains that are not finite numbers above 0, `no-overlap` when no pixel of the reference is covered, `size-mismatch`, `out-of-memory`.
pub fn quality(warped: &Warped, reference: ImageView<'_>, gains: [f64; 3]) -> Result<Quality> {
    warped.check_canvas(reference)?;
    if warped.confidence.is_none() && gains == [1.0; 3] && !reference.is_masked() {
        return measured(&warped.image, warped.offset, reference);
    }
    check_gains(gains)?;
    let table = gain_table(gains)?;
    let (width, height) = reference.size();
    let mut target = Image::transparent(width, height)?;
    let stride = warped.image.width();
    // Squared errors of red, green and blue: as they are, and after the gain.
    let mut errors = [[0u64; 3]; 2];
    let rows = target.pixels_mut().chunks_exact_mut(width);
    for ((y, row), photo) in rows.enumerate().zip(reference.pixels().chunks_exact(width)) {
        let start = (warped.offset.1 + y) * stride + warped.offset.0;
        let pixels = &warped.image.pixels()[start..start + width];
        let confidence = warped.confidence.as_ref().map(|mask| &mask.data()[start..start + width]);
        for (x, ((out, pixel), other)) in row.iter_mut().zip(pixels).zip(photo).enumerate() {
            if pixel[3] == 0
                || !reference.is_there(*other)
                || confidence.is_some_and(|confidence| confidence[x] < RELIABLE)
            {
                continue;
            }
            *out = *pixel;
            for c in 0..3 {
                let squared = |level: u8| u64::from(level.abs_diff(other[c])) * u64::from(level.abs_diff(other[c]));
                errors[0][c] += squared(pixel[c]);
                errors[1][c] += squared(table[c][usize::from(pixel[c])]);
            }
        }
    }
    for (c, table) in table.iter().enumerate().filter(|(c, _)| errors[1][*c] < errors[0][*c]) {
        target.pixels_mut().iter_mut().for_each(|pixel| pixel[c] = table[usize::from(pixel[c])]);
    }
    measured(&target, (0, 0), reference)
}

fn measured(target: &Image, offset: (usize, usize), reference: ImageView<'_>) -> Result<Quality> {
    let (width, height) = reference.size();
    let whole = Overlap { target, offset, reference, left: 0, top: 0, width, height };
    let row = |y: usize| extent(whole.row(y).0.iter().map(|pixel| pixel[3] != 0));
    let Rect { x, y, width, height } = bounding_box(reference.height(), &row).ok_or(Error::NoOverlap { pixels: 0 })?;
    let overlap = Overlap { left: x, top: y, width, height, ..whole };
    let (mut covered, mut error) = (0u64, 0u64);
    for (target, reference) in overlap.rows() {
        let (pixels, squared) = squared_error(target, reference);
        (covered, error) = (covered + pixels, error + squared);
    }
    let similarity = ssim::similarity(&overlap, covered)?;
    let pixels = |width: usize, height: usize| width as f64 * height as f64;
    let there = if reference.is_masked() {
        reference.pixels().iter().filter(|pixel| reference.is_there(**pixel)).count() as f64
    } else {
        pixels(reference.width(), reference.height())
    };
    Ok(Quality {
        psnr_bbox: psnr(error, pixels(overlap.width, overlap.height)),
        ssim_bbox: similarity.whole,
        psnr_mask: psnr(error, covered as f64),
        ssim_mask: similarity.masked,
        coverage: covered as f64 / there,
    })
}

/// A rectangle of the reference, and the picture over it.
struct Overlap<'a> {
    target: &'a Image,
    /// Of the reference in the target.
    offset: (usize, usize),
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
        let (image, (dx, dy)) = (self.target, self.offset);
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
