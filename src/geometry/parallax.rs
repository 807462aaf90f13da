//! Whether the matches show parallax at all.

use super::errors::errors;
use super::points::{Points, Projection};
use super::statistics::median;

/// Error of the best localised matches, in pixels: what is smaller is rounding.
const FINEST: f64 = 0.01;

/// Whether the depth model explains `points` better than the homography, by more than three numbers more to choose must.
///
/// A flat scene, a pure rotation and a constant depth leave H∞ and e' undetermined or e' = 0; with noise the fit still
/// returns *some* e'. So weigh the two models: with σ from the depth model's inliers (Rayleigh: median 1.177 σ), the
/// cost Σ min(r²/σ², 9) must fall by 3·ln 2n (BIC), not counting the two matches that gain most: three numbers
/// more can always be spent on two outliers.
pub(super) fn observable(points: &Points, inliers: &[bool], depth: &Projection, flat: &Projection, scale: f64) -> bool {
    const CAP: f64 = 9.0;
    let with_depth: Vec<f64> = errors(points, depth);
    let chosen: Vec<f64> = with_depth.iter().zip(inliers).filter(|(_, f)| **f).map(|(e, _)| *e).collect();
    let n = chosen.len();
    let Some(middle) = median(chosen) else { return false };
    let equations = 2.0 * n as f64;
    let freedom = equations / (equations - 11.0).max(1.0);
    let variance = (middle / (1.177 * 1.177) * freedom).max(FINEST * FINEST * scale * scale);
    let share = |e: f64| (e / variance).min(CAP);
    let gains = with_depth.iter().zip(errors(points, flat)).map(|(d, h)| share(h) - share(*d));
    let (mut sum, mut largest) = (0.0, [0.0f64; 2]);
    for gain in gains {
        sum += gain;
        largest = [largest[0].max(gain), largest[1].max(largest[0].min(gain))];
    }
    sum - largest[0] - largest[1] > 3.0 * libm::log(equations)
}
