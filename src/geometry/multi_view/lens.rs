//! The radial distortion of the lens, where the matches show one.

use super::bundle::{FreeParameters, adjust};
use super::growth::{LANDMARKS, MANY};
use super::resection::TOLERANCE;
use super::scene::{MOST_NOISE, Scene};
use super::tracks::{Track, select_tracks};
use crate::geometry::Distortion;

/// Lenses distort if that brings the noise down to this share of what it is otherwise, while no fewer places are explained than this
/// share of the others. On the real sets whose lenses do it is .87 and less, on others and variants of them .91 and more.
const NOISE_RATIO: f64 = 0.89;
pub(super) const COUNT_RATIO: f64 = 0.98;

/// The finished scene with the distortion that explains it, if that does so clearly better than none: else without any.
pub(super) fn with_distortion(
    scene: Scene,
    tracks: &[Track],
    root: usize,
    free: FreeParameters,
    prior: [f64; 2],
) -> Scene {
    let few = select_tracks(tracks, scene.cameras.len(), LANDMARKS);
    let adjusted = |scene: &Scene, free: FreeParameters| {
        let mut scene = scene.clone();
        for (tolerance, tracks) in [(3.0 * TOLERANCE, &few[..]), (TOLERANCE, &few), (TOLERANCE, tracks)] {
            scene.triangulate(tracks, tolerance);
            if free.positions {
                scene.normalise();
            }
            adjust(&mut scene, root, free, prior, MANY);
            scene.estimate_noise();
        }
        scene.triangulate(tracks, TOLERANCE);
        scene
    };
    let distorted = adjusted(&scene, FreeParameters { distortion: true, ..free });
    let straight = |scene: &Scene| adjusted(&Scene { distortion: Distortion::default(), ..scene.clone() }, free);
    let scene = if scene.distortion == Distortion::default() { scene } else { straight(&scene) };
    let noise = |scene: &Scene| scene.residual_noise().unwrap_or(f64::INFINITY);
    let explained = |scene: &Scene| scene.landmarks.iter().map(|landmark| landmark.seen.len()).sum::<usize>() as f64;
    let better = |other: &Scene| {
        noise(&distorted) < NOISE_RATIO * noise(other) && explained(&distorted) > COUNT_RATIO * explained(other)
    };
    let possible = distorted.distortion.0.abs() <= Distortion::MOST && noise(&distorted) < MOST_NOISE;
    if !possible || !better(&scene) {
        return scene;
    }
    // It may have led to a better place that is as good without it.
    if better(&straight(&distorted)) { distorted } else { scene }
}
