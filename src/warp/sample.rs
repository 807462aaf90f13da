//! Bilinear sampling of the target photo.

use crate::ImageView;

/// RGB at (x, y), which lies within the photo, bilinear, 0 to 255.
#[inline]
pub(super) fn bilinear(image: &ImageView<'_>, x: f32, y: f32) -> [f32; 4] {
    let (w, h) = (image.width(), image.height());
    // The last column and row are reached from the pixel before, so that the neighbours always exist.
    let (ix, iy) = ((x as usize).min(w.saturating_sub(2)), (y as usize).min(h.saturating_sub(2)));
    let (fx, fy) = (x - ix as f32, y - iy as f32);
    let stride = 4 * w;
    let i = iy * stride + 4 * ix;
    let data = image.data();
    let (Some(top), Some(bottom)) = (data.get(i..i + 8), data.get(i + stride..i + stride + 8)) else {
        return image.pixel(ix, iy).map(f32::from); // a photo one pixel wide or high
    };
    let mut out = [0.0; 4];
    for k in 0..4 {
        let a = f32::from(top[k]) + fx * (f32::from(top[k + 4]) - f32::from(top[k]));
        let b = f32::from(bottom[k]) + fx * (f32::from(bottom[k + 4]) - f32::from(bottom[k]));
        out[k] = a + fy * (b - a);
    }
    out
}
