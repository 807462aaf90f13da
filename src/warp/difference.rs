//! How much the photos' colours differ all over: by noise and exposure.

use super::sample::photometric_error;
use super::scene::Scene;

/// One pixel in so many is looked at: a prime, so that they lie in all columns; the other one where the first divides the width.
const STRIDES: [usize; 2] = [61, 67];

/// The mean photometric error over the overlap, by the reverse model: of noise and exposure, and of what is occluded or
/// misaligned. 0 without overlap.
pub(super) fn mean(scene: &Scene<'_>) -> f64 {
    let (width, height) = scene.target.size();
    let row = scene.reference.width();
    let (mut sum, mut pixels) = (0.0, f64::MIN_POSITIVE);
    let back = |x: f64, y: f64, d: f64| match &scene.surface {
        Some(surface) => {
            let place = scene.reverse.h * surface.ray([x, y]) + scene.reverse.e * d;
            (place[2] > 0.0).then(|| [place[0] / place[2], place[1] / place[2]])
        }
        None => scene.reverse.project(x, y, d),
    };
    let stride = STRIDES[usize::from(row.is_multiple_of(STRIDES[0]))];
    let mut index = 0;
    while let Some(colour) = scene.reference.pixels().get(index) {
        let d = scene.reference_depth.and_then(|depth| depth.data().get(index)).map_or(0.0, |d| f64::from(*d));
        if scene.reference.is_there(*colour)
            && let Some(place) = back((index % row) as f64, (index / row) as f64, d)
            && let [u, v] = place.map(|p| (p + 0.5).floor())
            && u >= 0.0
            && v >= 0.0
            && u < width as f64
            && v < height as f64
            && let Some(other) = scene.target.pixels().get(v as usize * width + u as usize)
            && scene.target.is_there(*other)
        {
            let [colour, other] = [*colour, *other].map(u32::from_le_bytes);
            (sum, pixels) = (sum + f64::from(photometric_error(colour, other)), pixels + 1.0);
        }
        index += stride;
    }
    sum / pixels
}
