//! Average blending with masks.

use super::check_canvas;
use crate::image::reserve;
use crate::warp::Warped;
use crate::{Image, ImageView, Mask, Result};

/// The two photos on one canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Mosaic {
    /// RGBA, alpha 255 where either photo is valid, 0 (and black) elsewhere.
    pub image: Image,
    /// Pixels inside the warped target's footprint that neither photo covers.
    pub voids: Mask,
}

/// Average of the two where both are valid (rounded to nearest, halves up), the valid one elsewhere.
///
/// The target is valid where the warped alpha is not 0, the reference in its whole frame (its alpha is ignored).
///
/// # Errors
/// `size-mismatch` when the reference does not fit the canvas or the footprint is not the canvas's size,
/// `out-of-memory`.
pub fn blend(warped: &Warped, reference: ImageView<'_>) -> Result<Mosaic> {
    check_canvas(warped, reference)?;
    let Image { data: canvas, width, height } = &warped.image;
    let (width, height) = (*width, *height);
    let mut data = Vec::new();
    reserve(&mut data, canvas.len())?;
    data.extend_from_slice(canvas);
    data.as_chunks_mut().0.iter_mut().for_each(|pixel| *pixel = opaque_or_empty(*pixel));
    let (left, top) = warped.offset;
    let rows = data.chunks_exact_mut(4 * width).skip(top);
    for (row, photo) in rows.zip(reference.data().chunks_exact(4 * reference.width())) {
        let pixels = row[4 * left..].as_chunks_mut().0;
        for (pixel, &other) in pixels.iter_mut().zip(photo.as_chunks().0) {
            *pixel = average(*pixel, other);
        }
    }
    let mut voids = Vec::new();
    reserve(&mut voids, width * height)?;
    let drawn = warped.footprint.data.iter().zip(data.as_chunks::<4>().0);
    voids.extend(drawn.map(|(&drawn, pixel)| if drawn != 0 && pixel[3] == 0 { 255 } else { 0 }));
    Ok(Mosaic { image: Image { data, width, height }, voids: Mask { data: voids, width, height } })
}

/// Four bytes as one word, alpha on top: whole words are what the compiler turns into SIMD.
const ALPHA: u32 = 0xff00_0000;

fn opaque_or_empty(pixel: [u8; 4]) -> [u8; 4] {
    let p = u32::from_le_bytes(pixel);
    if p & ALPHA != 0 { p | ALPHA } else { 0 }.to_le_bytes()
}

/// `pixel` is opaque or empty, `photo` is valid whatever its alpha. The bytes are averaged side by side in the word:
/// ⌈(a + b) / 2⌉ = (a | b) − ((a ^ b) >> 1), no byte borrowing from its neighbour.
fn average(pixel: [u8; 4], photo: [u8; 4]) -> [u8; 4] {
    let (p, q) = (u32::from_le_bytes(pixel), u32::from_le_bytes(photo) | ALPHA);
    let mean = (p | q) - (((p ^ q) >> 1) & 0x7f7f_7f7f);
    if p & ALPHA != 0 { mean } else { q }.to_le_bytes()
}
