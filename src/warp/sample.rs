//! Bilinear sampling of the target photo.

use crate::ImageView;

/// RGBA at (x, y), which lies within the photo, 0 to 255.
#[inline(always)]
pub(super) fn bilinear(image: &ImageView<'_>, [x, y]: [f64; 2]) -> [f32; 4] {
    let (w, h) = (image.width(), image.height());
    // The last column and row are reached from the pixel before, so that the neighbours always exist.
    let (ix, iy) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
    let (fx, fy) = ((x - ix as f64) as f32, (y - iy as f64) as f32);
    let (data, i) = (image.data(), 4 * (iy * w + ix));
    let (Some(top), Some(bottom)) = (data.get(i..i + 8), data.get(i + 4 * w..i + 4 * w + 8)) else {
        return image.pixel(ix, iy).map(f32::from); // a photo one pixel wide or high
    };
    let at = |row: &[u8], k: usize| f32::from(row[k]);
    std::array::from_fn(|k| {
        let a = at(top, k) + fx * (at(top, k + 4) - at(top, k));
        let b = at(bottom, k) + fx * (at(bottom, k + 4) - at(bottom, k));
        a + fy * (b - a)
    })
}
