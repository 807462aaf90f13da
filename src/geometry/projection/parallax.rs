//! Whether the matches show parallax that the depth explains.

use crate::geometry::correspondences::{Correspondences, ProjectionMatrix};
use crate::geometry::ransac::score::squared_errors;
use crate::statistics::{RAYLEIGH_MEDIAN, median};

/// Least standard deviation of a match, in pixels: smaller errors are rounding.
const MIN_SIGMA: f64 = 0.01;
/// A depth model has 11 degrees of freedom, three more than a homography.
const DEPTH_FREEDOM: f64 = 11.0;
const EXTRA_FREEDOM: f64 = 3.0;

/// Whether the depth model explains `points` better than the homography, by more than its three additional parameters
/// always can. `scale` is normalised units per pixel.
///
/// A flat scene, a pure rotation and a constant depth leave H∞ and e' undetermined or e' = 0; with noise the fit still
/// returns *some* e'. So compare the likelihoods of the two models, where a match either has an error of standard deviation
/// σ, that of the depth model's inliers, or is an outlier and lies anywhere in `area` (square pixels): the cost
/// Σ min(r²/σ², 2 ln(area/2πσ²)) must fall by 3·ln 2n (Bayesian information criterion), not counting the two matches that
/// gain most, since three parameters can always be spent on two outliers. A lower cost of an outlier would favour the
/// homography where most matches lie on one plane and the depth is inaccurate: it is exact there, and would hardly pay for
/// all those it misses.
pub(in crate::geometry) fn parallax_observable(
    points: &Correspondences,
    inliers: &[bool],
    depth: &ProjectionMatrix,
    homography: &ProjectionMatrix,
    scale: f64,
    area: f64,
) -> bool {
    let with_depth = squared_errors(points, depth);
    let inlying: Vec<f64> = with_depth.iter().zip(inliers).filter(|(_, f)| **f).map(|(e, _)| *e).collect();
    let equations = 2.0 * inlying.len() as f64;
    let Some(middle) = median(inlying) else { return false };
    let correction = equations / (equations - DEPTH_FREEDOM).max(1.0);
    let variance =
        (middle / (RAYLEIGH_MEDIAN * RAYLEIGH_MEDIAN) * correction).max(MIN_SIGMA * MIN_SIGMA * scale * scale);
    let outlier = 2.0 * libm::log(area * scale * scale / (std::f64::consts::TAU * variance));
    let cost = |e: f64| (e / variance).min(outlier);
    let gains = with_depth.iter().zip(squared_errors(points, homography)).map(|(d, h)| cost(h) - cost(*d));
    let (mut sum, mut largest) = (0.0, [0.0f64; 2]);
    for gain in gains {
        sum += gain;
        largest = [largest[0].max(gain), largest[1].max(largest[0].min(gain))];
    }
    sum - largest[0] - largest[1] > EXTRA_FREEDOM * libm::log(equations)
}
