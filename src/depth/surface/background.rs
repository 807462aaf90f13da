//! The plane of a scene that what only one photo shows is most naturally taken for.
//!
//! A plane of inverse depth is a homography to the other photo, so nothing in it bends. Which of the scene's planes shows the
//! rest as a person expects it is not said by its size alone: seen as part of the ground, a house leans.

use super::OtherView;
use crate::geometry::{DepthSample, anisotropy, dominant_plane, plane_depth, tile_planes, weighted_plane};
use crate::rect::{diagonal, grid_points};

/// Samples that are looked at. Tuned on the evaluation cases: flat between 1500 and 3000.
const SAMPLES: usize = 1500;
/// Planes are started from the samples of the whole photo, of quarters and of sixteenths.
const TILES: [usize; 3] = [1, 2, 4];
/// Distance in the other photo, as a share of its diagonal, of what is part of a plane. Tuned on the evaluation
/// cases: between 0.0015 and 0.006 PSNR changes by 0.2 %.
const TOLERANCE: f64 = 0.003;
/// Refits to these.
const REFITS: usize = 8;
/// How near the outside a sample has to be to weigh much, as a share of the diagonal. Tuned on the evaluation cases: flat between
/// 0.15 and 0.3.
const NEAR: f64 = 0.15;
/// What every sample weighs at least, next to one in the middle of the outside. Flat between 0.005 and 0.02.
const LEAST_WEIGHT: f64 = 0.01;
/// The outside is looked at at so many points a side. Flat between 12 and 48.
const POINTS: usize = 12;
/// How much larger, as a logarithm, a plane has to be for a unit of anisotropy. Tuned on the evaluation cases: flat between 3 and
/// 6.
const ANISOTROPY_WEIGHT: f64 = 3.0;

/// a, b, c of the inverse depth ax + by + c: a plane that many of the samples near the outside are part of, and that shows a
/// photo of this size without making it lean. `None` if all samples lie on one line.
pub(super) fn background(samples: &[DepthSample], size: (usize, usize), other: &OtherView<'_>) -> Option<[f64; 3]> {
    let samples: Vec<DepthSample> = samples.iter().step_by((samples.len() / SAMPLES).max(1)).copied().collect();
    let dominant = dominant_plane(&samples, 1.0)?;
    let weights = near_outside(&samples, size, dominant, other);
    let tolerance = TOLERANCE * diagonal(other.size);
    let mut best = (dominant, f64::NEG_INFINITY);
    for mut plane in tile_planes(&samples, size, &TILES, 0) {
        for _ in 0..REFITS {
            let Some(better) = refit(&samples, &weights, plane, tolerance) else { break };
            plane = better;
        }
        let score = score(&samples, &weights, plane, tolerance, (size, other));
        if score > best.1 {
            best = (plane, score);
        }
    }
    Some(best.0)
}

/// How much each sample says about what lies outside of the other photo.
fn near_outside(samples: &[DepthSample], size: (usize, usize), plane: [f64; 3], other: &OtherView<'_>) -> Vec<f64> {
    let outer: Vec<[f64; 2]> =
        grid_points(size, POINTS).filter(|p| other.distance(*p, plane_depth(plane, *p)) > 0.0).collect();
    let reach = NEAR * diagonal(size);
    let near = |s: &DepthSample, p: &[f64; 2]| {
        let (x, y) = (p[0] - s.point[0], p[1] - s.point[1]);
        libm::exp(-(x * x + y * y).sqrt() / reach)
    };
    samples.iter().map(|s| outer.iter().map(|p| near(s, p)).sum::<f64>() + LEAST_WEIGHT).collect()
}

/// The plane again, by weighted least squares of what is part of it; `None` when that is on one line.
fn refit(samples: &[DepthSample], weights: &[f64], plane: [f64; 3], tolerance: f64) -> Option<[f64; 3]> {
    let part = samples.iter().zip(weights).filter(|(s, _)| s.distance(plane) < tolerance);
    weighted_plane(part.map(|(s, weight)| (s, weight * s.parallax * s.parallax)))
}

/// Logarithm of the share of the samples in a plane, less its anisotropy.
fn score(
    samples: &[DepthSample],
    weights: &[f64],
    plane: [f64; 3],
    tolerance: f64,
    (size, other): ((usize, usize), &OtherView<'_>),
) -> f64 {
    let all: f64 = weights.iter().sum();
    let part: f64 = samples.iter().zip(weights).filter(|(s, _)| s.distance(plane) < tolerance).map(|(_, w)| w).sum();
    let leaning = anisotropy(size, &|x, y| other.model.project(x, y, plane_depth(plane, [x, y])));
    libm::log(part / all) - ANISOTROPY_WEIGHT * leaning.unwrap_or(0.0)
}
