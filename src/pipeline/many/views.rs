//! How photos look at a smaller size, at which they are compared.

use crate::features::{Luma, luma};
use crate::pipeline::bilinear::{Bilinear, in_cells};
use crate::{ImageView, Result};

/// The longer side.
const SIDE: usize = 640;
/// A place with less contrast around it, in levels, is not textured: what stereo finds there is what it expected.
const CONTRAST: f32 = 14.0;
const AROUND: usize = 4;

/// Photos as they are compared.
pub(super) struct Views {
    pub views: Vec<Option<Luma>>,
}

impl Views {
    /// Of the photos that are `used`.
    pub fn of(photos: &[ImageView<'_>], used: &[usize]) -> Result<Self> {
        let view = |(i, photo): (usize, &ImageView<'_>)| used.contains(&i).then(|| view(*photo)).transpose();
        Ok(Self { views: photos.iter().enumerate().map(view).collect::<Result<_>>()? })
    }
}

/// How a photo looks at [`SIDE`], NaN where it is masked.
pub(super) fn view(photo: ImageView<'_>) -> Result<Luma> {
    let (w, h) = photo.size();
    let longer = w.max(h).max(SIDE);
    let (width, height) = ((w * SIDE).div_ceil(longer).max(2).min(w), (h * SIDE).div_ceil(longer).max(2).min(h));
    let mut view = luma(photo, (width, height))?;
    if photo.is_masked() {
        for (at, level) in view.data.iter_mut().enumerate() {
            if !photo.is_there(photo.pixel(at % width * w / width, at / width * h / height)) {
                *level = f32::NAN;
            }
        }
    }
    Ok(view)
}

/// Whether there is enough contrast around a pixel of a view.
pub(super) fn textured(view: &Luma, [x, y]: [usize; 2]) -> bool {
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for row in y.saturating_sub(AROUND)..(y + AROUND + 1).min(view.height) {
        let columns = x.saturating_sub(AROUND).min(view.width)..(x + AROUND + 1).min(view.width);
        for &level in &view.data[row * view.width..][columns] {
            (least, most) = (least.min(level), most.max(level));
        }
    }
    most - least > CONTRAST
}

/// How bright a place of a photo of this size is in its view; NaN outside.
pub(super) fn brightness_at(view: &Luma, (w, h): (usize, usize), point: [f64; 2]) -> f32 {
    let cell = [w as f64 / view.width as f64, h as f64 / view.height as f64];
    Bilinear::at(in_cells(point, cell), view.width, view.height)
        .map_or(f32::NAN, |around| around.interpolate(&view.data))
}
