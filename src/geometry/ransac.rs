//! Random sample consensus with the MSAC score (Torr & Zisserman 2000) and an adaptive number of trials.

use super::linear::{fit, orient};
use super::points::{Points, Projection, msac_cost};
use super::sampler::Sampler;

/// How to search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    /// Largest error of an inlier, normalised.
    pub threshold: f64,
    pub confidence: f64,
    pub max_trials: u32,
    /// Refit every best-so-far model to its inliers (Chum, Matas & Kittler 2003).
    pub local: bool,
}

/// What a search found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub projection: Projection,
    pub trials: u32,
}

/// A sample must vary by this share of all matches' variance in x, y and (depth model) d, each beyond what the ones
/// before explain: in one spot, on one line or on one plane of depth it tells nothing.
const SAMPLE_SPREAD: f64 = 1e-4;

/// The best of the models through K random matches, K = 6 with D = 4 (depth) and K = 4 with D = 3 (homography).
/// `None` when no sample gave a model.
pub(super) fn msac<const D: usize, const K: usize>(
    points: &Points,
    search: &Search,
    sampler: &mut Sampler,
) -> Option<Found> {
    let n = points.len();
    let t2 = search.threshold * search.threshold;
    let mut best: Option<Projection> = None;
    let mut cost = f64::INFINITY;
    let mut needed = f64::from(search.max_trials);
    let mut trials = 0;
    while f64::from(trials) < needed && n >= K {
        trials += 1;
        let sample: [usize; K] = sampler.sample(n);
        let Some(model) = fit::<D>(points, sample.into_iter(), SAMPLE_SPREAD) else { continue };
        let Some(model) = orient(model, points, sample.into_iter()) else { continue };
        let sampled = msac_cost(points, &model, t2, cost);
        if sampled >= cost {
            continue;
        }
        (best, cost) = (Some(model), sampled);
        let mut inliers = inliers_of(points, &model, t2);
        if search.local {
            for _ in 0..3 {
                let Some(model) = refit::<D>(points, &inliers) else { break };
                let refitted = msac_cost(points, &model, t2, cost);
                if refitted >= cost {
                    break;
                }
                (best, cost) = (Some(model), refitted);
                inliers = inliers_of(points, &model, t2);
            }
        }
        // ln(1 − conf) / ln(1 − ratioᴷ); log1p, as 1 − ratioᴷ rounds to 1 for a tiny ratio.
        let ratio = inliers.iter().filter(|f| **f).count() as f64 / n as f64;
        let clean = (0..K).fold(1.0, |p, _| p * ratio);
        if clean > 0.0 {
            needed = (libm::log1p(-search.confidence) / libm::log1p(-clean)).ceil().clamp(1.0, f64::from(search.max_trials));
        }
    }
    best.map(|projection| Found { projection, trials })
}

/// The linear fit to the flagged matches, the most of them in front of the camera.
pub(super) fn refit<const D: usize>(points: &Points, inliers: &[bool]) -> Option<Projection> {
    let indices = || inliers.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i);
    let model = fit::<D>(points, indices(), 1e-10)?;
    orient(model, points, indices())
}

/// Which matches are within the threshold.
pub(super) fn inliers_of(points: &Points, model: &Projection, t2: f64) -> Vec<bool> {
    points.errors(model).map(|e| e < t2).collect()
}
