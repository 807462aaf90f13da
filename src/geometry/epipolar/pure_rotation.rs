//! Pure rotation, of a camera that only turned: a homography of three parameters. Where the overlap is small its matches leave five more open, and what lies beyond
//! goes wherever noise sends it.

use nalgebra::Matrix3;

use super::cameras::intrinsics;
use super::essential::Rays;
use crate::geometry::calibrated::nearest_rotation;
use crate::geometry::summary::summarise;
use crate::geometry::usable::usable_matches;
use crate::geometry::{Estimate, Frame, Match, Model, ModelKind};

/// Reweightings of the fit; it hardly changes after ten.
const PASSES: usize = 20;
/// Distance in pixels from where a match should be from which on it counts less.
const NOISE: f64 = 2.0;
/// Of the inliers, in pixels: near things are off by their parallax.
const THRESHOLD: f64 = 5.0;

/// The homography between photos of these `sizes` if the camera only turned: the rotation with the least sum of distances, of all `matches`. `focal` is
/// the target's focal length in pixels: without one a usual one is taken. `None` if the matches determine no rotation.
pub(crate) fn pure_rotation(matches: &[Match], sizes: [(usize, usize); 2], focal: Option<f64>) -> Option<Estimate> {
    let [target, reference] = intrinsics(sizes, focal).into_iter().next()?;
    let frames = sizes.map(|size| Frame { size, depth: None });
    let usable = usable_matches(matches, [&frames[0], &frames[1]]);
    let rays: Vec<Rays> = usable.iter().map(|m| [target.ray(m.ends[0]), reference.ray(m.ends[1])]).collect();
    let mut weights = vec![1.0; rays.len()];
    let mut rotation = Matrix3::identity();
    for _ in 0..PASSES {
        rotation = rotation_between(&rays, &weights)?;
        for ([from, to], weight) in rays.iter().zip(&mut weights) {
            *weight = 1.0 / (reference.focal * (rotation * from.normalize() - to.normalize()).norm()).max(NOISE);
        }
    }
    let model = Model::homography(reference.matrix() * rotation * target.matrix().try_inverse()?);
    let models = [model, model.inverse()?];
    let error = |ends: [[f64; 2]; 2], side: usize| models[side].transfer_error(ends[side], 0.0, ends[1 - side]);
    let inlying: Vec<_> =
        usable.iter().filter(|m| error(m.ends, 0).is_some_and(|error| error <= THRESHOLD)).copied().collect();
    let counts = [matches.len(), usable.len()];
    let found = summarise(&inlying, models, ModelKind::Homography, counts, |m, side| error(m.ends, side));
    Some(Estimate { threshold: THRESHOLD, focal: Some(target.focal), ..found })
}

/// The rotation that comes closest to taking the first of two rays each to the second, by least squares of their directions (Arun, Huang & Blostein
/// 1987).
pub(in crate::geometry) fn rotation_between(rays: &[Rays], weights: &[f64]) -> Option<Matrix3<f64>> {
    let product = |[from, to]: &Rays| to.normalize() * from.normalize().transpose();
    nearest_rotation(
        rays.iter().zip(weights).fold(Matrix3::zeros(), |sum, (rays, weight)| sum + product(rays) * *weight),
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::calibrated::small_rotation;

    #[test]
    fn a_turn_is_found_from_matches_in_a_narrow_overlap_a_third_of_which_are_wrong() {
        let (size, focal) = ((1200, 900), 1000.0);
        let k = Matrix3::new(focal, 0.0, 599.5, 0.0, focal, 449.5, 0.0, 0.0, 1.0);
        let rotation = small_rotation(Vector3::new(0.03, -0.75, 0.02));
        let truth = Model::homography(k * rotation * k.try_inverse().unwrap());
        let mut matches = Vec::new();
        for i in 0..90 {
            let [x, y] = [1000.0 + (i % 9) as f64 * 20.0, 100.0 + (i / 9) as f64 * 70.0];
            let place = truth.project(x, y, 0.0).unwrap();
            let wrong = if i % 3 == 0 { 150.0 * ((i * 7 % 11) as f64 / 11.0 - 0.5) } else { 0.0 };
            matches.push(Match { target: [x, y], reference: [place[0] + wrong, place[1] - wrong] });
        }
        let found = pure_rotation(&matches, [size; 2], Some(focal)).unwrap();
        assert!(found.inliers.iter().enumerate().all(|(i, inlier)| *inlier || i % 3 == 0));
        // Far from all matches, where a homography of as many parameters as it has goes astray.
        for [x, y] in [[100.0, 50.0], [100.0, 850.0], [600.0, 450.0]] {
            let (a, b) = (truth.transform(x, y, 0.0), found.forward.transform(x, y, 0.0));
            let angle =
                Vector3::from(a).cross(&Vector3::from(b)).norm() / (Vector3::from(a).norm() * Vector3::from(b).norm());
            assert!(angle < 1e-3, "{x} {y} {angle}");
        }
        assert!(pure_rotation(&[], [size; 2], None).is_none());
    }
}
