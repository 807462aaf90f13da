//! The plane at infinity of plane and parallax.
//!
//! Two photos determine their relative inverse depth g but for a projective change: where g is constant, things may be at very different
//! distances. With cameras, inverse depth is β(g − p), where p, affine in x and y, is the g of what is infinitely far.

use super::cameras::two_cameras;
use super::essential::Rays;
use crate::geometry::model::Model;
use crate::geometry::plane::{DepthSample, plane_depth, weighted_plane};

/// Reweightings of the fit; it hardly changes after ten.
const PASSES: usize = 20;
/// Distance in pixels from where a match should be from which on it counts less.
const NOISE: f64 = 1.0;

/// A match with its relative inverse depth, and with its inverse depth.
type Sample = [DepthSample; 2];

/// a, b, c of the relative inverse depth ax + by + c of what is infinitely far, at x, y of the photo that `model` leads from. `sizes` are
/// those of both photos, `matches` lead from one to the other, and `focal` is the first one's focal length in pixels: without one a usual one is
/// taken, on which the slopes a and b hardly depend. `None` if the matches do not determine it.
pub(crate) fn plane_at_infinity(
    model: &Model,
    matches: &[[[f64; 2]; 2]],
    sizes: [(usize, usize); 2],
    focal: Option<f64>,
) -> Option<[f64; 3]> {
    let cameras = two_cameras(model, matches, sizes, focal)?;
    let calibrated = Model { h: cameras.motion.0, e: cameras.motion.1 };
    let sample = |([point, place], [x, u]): (&[[f64; 2]; 2], &Rays)| {
        let relative = DepthSample::new(model, *point, model.triangulate(*point, *place)?);
        let depth = calibrated.triangulate([x[0], x[1]], [u[0], u[1]])?;
        Some([relative, DepthSample { depth, ..relative }])
    };
    let samples: Vec<Sample> = matches.iter().zip(&cameras.rays).filter_map(sample).collect();
    let plane = fit(&samples)?;
    plane.iter().all(|v| v.is_finite()).then_some(plane)
}

/// The plane p with g = w/β + p that explains the depths g and w with the least sum of distances, by iteratively reweighted least squares.
fn fit(samples: &[Sample]) -> Option<[f64; 3]> {
    let mut weights: Vec<f64> = samples.iter().map(|[g, _]| g.parallax * g.parallax).collect();
    let mut plane = [0.0; 3];
    for _ in 0..PASSES {
        // What planes leave of w explains what they leave of g, w/β (Frisch & Waugh 1933).
        let best = |k: usize| weighted_plane(samples.iter().map(|sample| &sample[k]).zip(weights.iter().copied()));
        let planes = [best(0)?, best(1)?];
        let left = |s: &Sample| [0, 1].map(|k| s[k].depth - plane_depth(planes[k], s[k].point));
        let (mut product, mut square) = (0.0, 0.0);
        for (sample, weight) in samples.iter().zip(&weights) {
            let [g, w] = left(sample);
            (product, square) = (product + weight * g * w, square + weight * w * w);
        }
        let scale = product / square;
        plane = [0, 1, 2].map(|i| planes[0][i] - scale * planes[1][i]);
        for (sample, weight) in samples.iter().zip(&mut weights) {
            let ([g, w], parallax) = (left(sample), sample[0].parallax);
            *weight = parallax * parallax / ((g - scale * w).abs() * parallax).max(NOISE);
        }
    }
    Some(plane)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::calibrated::small_rotation;

    /// A camera that moved and turned, and what it saw: models with relative inverse depth, matches, and the true plane at infinity.
    fn scene(cut: f64) -> (Model, Vec<[[f64; 2]; 2]>, [f64; 3]) {
        let k = |x: f64| Matrix3::new(760.0, 0.0, x, 0.0, 760.0, 299.5, 0.0, 0.0, 1.0);
        let (from, to) = (k(399.5), k(399.5 - cut));
        let rotation = small_rotation(Vector3::new(0.02, 0.3, -0.03));
        let e = to * Vector3::new(-0.4, 0.05, 0.1);
        // With g = w + p, H∞ is H + e pᵀ.
        let plane = Vector3::new(2e-4, -3e-4, 0.1);
        let h = to * rotation * from.try_inverse().unwrap() - e * plane.transpose();
        let model = Model { h, e };
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let matches = (0..200).filter_map(|_| {
            let (x, y, w) = (800.0 * next(), 600.0 * next(), 0.05 + 0.5 * next());
            let place = model.project(x, y, w + plane.dot(&Vector3::new(x, y, 1.0)))?;
            Some([[x, y], place])
        });
        (model, matches.collect(), plane.into())
    }

    #[test]
    fn plane_at_infinity_of_random_points() {
        for (cut, size) in [(0.0, (800, 600)), (200.0, (600, 600))] {
            let (model, matches, truth) = scene(cut);
            let found = plane_at_infinity(&model, &matches, [(800, 600), size], None).unwrap();
            for k in 0..2 {
                assert!((found[k] - truth[k]).abs() < 2e-5, "{cut}: {found:?} instead of {truth:?}");
            }
            let known = plane_at_infinity(&model, &matches, [(800, 600), size], Some(760.0)).unwrap();
            assert!((known[2] - truth[2]).abs() < 1e-3, "{cut}: {known:?} instead of {truth:?}");
        }
    }
}
