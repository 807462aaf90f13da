//! Whether the matches show parallax at all.

use super::errors::errors;
use super::points::{Points, Projection};
use crate::statistics::median;

/// Error of the best localised matches, in pixels: what is smaller is rounding.
const FINEST: f64 = 0.01;

/// Whether the depth model explains `points` better than the homography, by more than three numbers more to choose must.
///
/// A flat scene, a pure rotation and a constant depth leave H∞ and e' undetermined or e' = 0; with noise the fit still
/// returns *some* e'. So weigh the likelihoods of the two models, where a match either errs by σ, that of the depth model's
/// inliers (Rayleigh: median 1.177 σ), or is wrong and lies anywhere in `area` (square pixels): the cost
/// Σ min(r²/σ², 2 ln(area/2πσ²)) must fall by 3·ln 2n (BIC), not counting the two matches that gain most: three numbers more
/// can always be spent on two wrong matches. A lower price of a wrong match would favour the homography where most
/// matches lie on one plane and the depth errs: it is exact there, and hardly pays for all those it misses.
pub(super) fn observable(
    points: &Points,
    inliers: &[bool],
    depth: &Projection,
    flat: &Projection,
    scale: f64,
    area: f64,
) -> bool {
    let with_depth: Vec<f64> = errors(points, depth);
    let chosen: Vec<f64> = with_depth.iter().zip(inliers).filter(|(_, f)| **f).map(|(e, _)| *e).collect();
    let n = chosen.len();
    let Some(middle) = median(chosen) else { return false };
    let equations = 2.0 * n as f64;
    let freedom = equations / (equations - 11.0).max(1.0);
    let variance = (middle / (1.177 * 1.177) * freedom).max(FINEST * FINEST * scale * scale);
    let wrong = 2.0 * libm::log(area * scale * scale / (std::f64::consts::TAU * variance));
    let share = |e: f64| (e / variance).min(wrong);
    let gains = with_depth.iter().zip(errors(points, flat)).map(|(d, h)| share(h) - share(*d));
    let (mut sum, mut largest) = (0.0, [0.0f64; 2]);
    for gain in gains {
        sum += gain;
        largest = [largest[0].max(gain), largest[1].max(largest[0].min(gain))];
    }
    sum - largest[0] - largest[1] > 3.0 * libm::log(equations)
}
