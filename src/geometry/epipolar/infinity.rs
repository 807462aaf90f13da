//! The plane at infinity of plane and parallax.
//!
//! Two photos determine their relative inverse depth g but for a projective change: where g is constant, things may be at very different
//! distances. With cameras, inverse depth is β(g − p), where p, affine in x and y, is the g of what is infinitely far.

use nalgebra::{Matrix4, Vector4};

use super::cameras::two_cameras;
use super::essential::Rays;
use crate::geometry::model::Model;

/// Reweightings of the fit; it hardly changes after ten.
const PASSES: usize = 20;
/// Distance in pixels from where a match should be from which on it counts less.
const NOISE: f64 = 1.0;

/// A match: the coefficients a, b, c and 1/β have in its relative inverse depth, that depth, and the pixels that a unit of it moves the match by.
struct Sample {
    row: Vector4<f64>,
    depth: f64,
    parallax: f64,
}

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
    let size = sizes[0].0.max(sizes[0].1) as f64;
    let sample = |([point, place], [x, u]): (&[[f64; 2]; 2], &Rays)| {
        let inverse_depth = calibrated.triangulate([x[0], x[1]], [u[0], u[1]])?;
        let depth = model.triangulate(*point, *place)?;
        let row = Vector4::new(point[0] / size, point[1] / size, 1.0, inverse_depth);
        Some(Sample { row, depth, parallax: model.parallax(*point, depth) })
    };
    let samples: Vec<Sample> = matches.iter().zip(&cameras.rays).filter_map(sample).collect();
    let [a, b, c, _] = fit(&samples)?;
    let plane = [a / size, b / size, c];
    plane.iter().all(|v| v.is_finite()).then_some(plane)
}

/// The coefficients that explain the depths with the least sum of distances, by iteratively reweighted least squares.
fn fit(samples: &[Sample]) -> Option<[f64; 4]> {
    let mut solution = Vector4::zeros();
    for pass in 0..PASSES {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for Sample { row, depth, parallax } in samples {
            let off = if pass == 0 { 0.0 } else { (row.dot(&solution) - depth).abs() * parallax };
            let weight = parallax * parallax / off.max(NOISE);
            normal.syger(weight, row, row, 1.0);
            right += row * (weight * depth);
        }
        solution = normal.cholesky()?.solve(&right);
    }
    Some(solution.into())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

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
