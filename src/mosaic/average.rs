//! Blending by averaging the two photos (paper, section 3.2.4).

use super::canvas::Placed;
use crate::Image;

/// Four bytes as one word, alpha on top: whole words are what the compiler turns into SIMD.
const ALPHA: u32 = 0xff00_0000;

/// Average of the two where both are valid (rounded to nearest, halves up), the valid one elsewhere. `image` holds the
/// target, each pixel opaque or empty.
pub(super) fn average(image: &mut Image, reference: &Placed<'_>) {
    let width = image.width();
    let rows = image.pixels_mut().chunks_exact_mut(width).skip(reference.top);
    for (row, photo) in rows.zip(reference.photo.pixels().chunks_exact(reference.photo.width())) {
        for (pixel, &other) in row[reference.left..].iter_mut().zip(photo) {
            if reference.is_valid(other) {
                *pixel = mean(*pixel, other);
            }
        }
    }
}

/// The pixel with alpha 255, or nothing at all where alpha is 0.
pub(super) fn opaque_or_empty(pixel: [u8; 4]) -> [u8; 4] {
    let p = u32::from_le_bytes(pixel);
    if p & ALPHA != 0 { p | ALPHA } else { 0 }.to_le_bytes()
}

/// `pixel` is opaque or empty, `photo` is there. The bytes are averaged side by side in the word:
/// ⌈(a + b) / 2⌉ = (a | b) − ((a ^ b) >> 1), no byte borrowing from its neighbour.
fn mean(pixel: [u8; 4], photo: [u8; 4]) -> [u8; 4] {
    let (p, q) = (u32::from_le_bytes(pixel), u32::from_le_bytes(photo) | ALPHA);
    let mean = (p | q) - (((p ^ q) >> 1) & 0x7f7f_7f7f);
    if p & ALPHA != 0 { mean } else { q }.to_le_bytes()
}
