//! Luma: the brightness of a pixel as stored, without undoing the transfer function.

use wide::{f32x4, i32x4, u32x4};

use crate::lanes::LANES;

/// Rec. 601 luma in levels of 0 to 255, unrounded: what features are detected on, as OpenCV's.
pub(crate) fn rec601([r, g, b, _]: [u8; 4]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}

/// The same of a row of pixels.
pub(crate) fn rec601_row(pixels: &[[u8; 4]], out: &mut [f32]) {
    let (fours, rest) = pixels.as_chunks();
    let (luma, last) = out.as_chunks_mut();
    for (&pixels, luma) in fours.iter().zip(luma) {
        let channels: u32x4 = bytemuck::cast::<[[u8; 4]; LANES], _>(pixels);
        let [r, g, b] = [0, 8, 16].map(|bits| {
            let levels: i32x4 = bytemuck::cast((channels >> bits) & u32x4::splat(255));
            f32x4::from_i32x4(levels)
        });
        *luma = (f32x4::splat(0.299) * r + f32x4::splat(0.587) * g + f32x4::splat(0.114) * b).to_array();
    }
    last.iter_mut().zip(rest).for_each(|(luma, &pixel)| *luma = rec601(pixel));
}

/// Rec. 601 luma rounded to a level, with weights in 256ths that add up to 1: what the stereo matching compares.
pub(crate) fn rec601_level([r, g, b, _]: [u8; 4]) -> u8 {
    ((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b) + 128) >> 8) as u8
}

/// Rec. 709 luma of 16 bit: what a depth map stored as a colour image is read as. Equal channels keep their value.
#[cfg(feature = "codecs")]
pub(crate) fn rec709([r, g, b, _]: [u16; 4]) -> u16 {
    ((2126 * u32::from(r) + 7152 * u32::from(g) + 722 * u32::from(b) + 5000) / 10_000) as u16
}
