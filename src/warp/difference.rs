//! How much the photos' colours differ.

use super::render::{Scene, photometric_error};

/// Every so many pixels across and down are looked at.
const STRIDE: usize = 8;

/// The mean photometric error over the overlap, as the reverse model has it: noise and exposure are in it, and how
/// much of the scene hides or is misaligned. 0 without overlap.
pub(super) fn mean(scene: &Scene<'_>) -> f64 {
    let [width, height] = [scene.target.width(), scene.target.height()];
    let (mut sum, mut pixels) = (0u64, 0u64);
    for y in (0..scene.reference.height()).step_by(STRIDE) {
        for x in (0..scene.reference.width()).step_by(STRIDE) {
            let index = y * scene.reference.width() + x;
            let d = scene.reference_depth.map_or(0.0, |depth| f64::from(depth.data()[index]));
            let Some(place) = scene.reverse.project(x as f64, y as f64, d) else { continue };
            // What lies before the first row or column turns into huge numbers.
            let [u, v] = place.map(|p| (p + 0.5).floor() as isize as usize);
            if u < width && v < height {
                let error = photometric_error(scene.reference.pixels()[index], scene.target.pixels()[v * width + u]);
                (sum, pixels) = (sum + error as u64, pixels + 1);
            }
        }
    }
    sum as f64 / pixels.max(1) as f64
}
