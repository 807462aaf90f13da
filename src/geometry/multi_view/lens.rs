//! The radial distortion of the lens, where the matches show one.

use super::bundle::FreeParameters;
use super::growth::adjust_to_inliers;
use super::resection::TOLERANCE;
use super::scene::{MOST_NOISE, Scene};
use super::tracks::{Track, count_observations};
use crate::geometry::Distortion;

/// Lenses distort if that brings the root mean square error down to this share of what it is otherwise: on real sets whose lenses do it is .82
/// and less, on others .93 and more.
const ERROR_RATIO: f64 = 0.89;
/// Photos by lenses that distort more are not taken for a picture; but a wrong geometry may look like it.
const MOST_DISTORTION: f64 = 0.45;

/// The finished scene with the distortion that explains it, if that does so clearly better than none: else without any. With distortion in what
/// is `free`, the other way round: without, only if that is clearly better.
pub(super) fn with_distortion(
    scene: Scene,
    tracks: &[Track],
    root: usize,
    free: FreeParameters,
    prior: [f64; 2],
) -> Scene {
    let adjusted = |scene: &Scene, free: FreeParameters| {
        let mut scene = scene.clone();
        adjust_to_inliers(&mut scene, tracks, &[3.0 * TOLERANCE, TOLERANCE], root, free, prior);
        scene
    };
    let expected = free.distortion;
    let distorted = adjusted(&scene, FreeParameters { distortion: true, ..free });
    let straight = |scene: &Scene| {
        let start = Scene { distortion: Distortion::default(), ..scene.clone() };
        adjusted(&start, FreeParameters { distortion: false, ..free })
    };
    let scene = if scene.distortion == Distortion::default() { scene } else { straight(&scene) };
    let observations = count_observations(tracks);
    let error = |scene: &Scene| scene.cost(observations).sqrt();
    let better = |one: &Scene, other: &Scene| error(one) < ERROR_RATIO * error(other);
    let noise = distorted.residual_noise().unwrap_or(f64::INFINITY);
    if distorted.distortion.0.abs() > MOST_DISTORTION || noise >= MOST_NOISE {
        return scene;
    }
    let chosen = if expected {
        !better(&scene, &distorted)
    } else {
        // It may have led to a better place that is as good without it.
        better(&distorted, &scene) && better(&distorted, &straight(&distorted))
    };
    if chosen { distorted } else { scene }
}
