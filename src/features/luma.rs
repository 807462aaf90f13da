//! The gray image that features are detected on.

use crate::image::{reserve, zeroed};
use crate::lanes::add_weighted;
use crate::luma::rec601_row;
use crate::{ImageView, Result};

/// Luma, 0 to 255, row by row.
pub(crate) struct Luma {
    pub data: Vec<f32>,
    pub width: usize,
    pub height: usize,
}

/// Rec. 601 luma resampled to `size`, at most the photo's: each value is the mean over the area that it covers.
pub(crate) fn luma(image: ImageView<'_>, size: (usize, usize)) -> Result<Luma> {
    let (width, height) = size;
    let mut data = Vec::new();
    reserve(&mut data, width * height)?;
    let mut line: Vec<f32> = zeroed(image.width())?;
    let mut sums: Vec<f32> = zeroed(image.width())?;
    for y in 0..height {
        sums.fill(0.0);
        for (row, weight) in covered(y, height, image.height()) {
            let pixels = &image.pixels()[row * image.width()..][..image.width()];
            rec601_row(pixels, &mut line);
            add_weighted(&mut sums, &line, weight);
        }
        if width == image.width() {
            data.extend_from_slice(&sums);
        } else {
            data.extend(
                (0..width).map(|x| covered(x, width, sums.len()).map(|(i, weight)| weight * sums[i]).sum::<f32>()),
            );
        }
    }
    Ok(Luma { data, width, height })
}

/// Luma of the size of the photo, NaN where that is masked.
pub(crate) fn visible_luma(image: ImageView<'_>) -> Result<Luma> {
    let mut luma = luma(image, image.size())?;
    if image.is_masked() {
        let missing = luma.data.iter_mut().zip(image.pixels()).filter(|(_, pixel)| !image.is_there(**pixel));
        missing.for_each(|(luma, _)| *luma = f32::NAN);
    }
    Ok(luma)
}

/// The indices of `from` values under value `i` of `to`, and the share of each.
fn covered(i: usize, to: usize, from: usize) -> impl Iterator<Item = (usize, f32)> {
    // In units of 1 / (from·to) nothing is rounded.
    let (from, to) = (from as u64, to as u64);
    let (start, end) = (i as u64 * from, (i as u64 + 1) * from);
    (start / to..end.div_ceil(to)).map(move |k| {
        let overlap = end.min((k + 1) * to) - start.max(k * to);
        (k as usize, overlap as f32 / from as f32)
    })
}
