//! From the best sample to a model and its inliers.

use super::{COARSE, FINE, ProjectionEstimator};
use crate::geometry::correspondences::{Correspondences, ProjectionMatrix};
use crate::geometry::ransac::local_optimisation::{anneal, converge};
use crate::geometry::ransac::score::{Scales, count, inlier_errors, inliers_of};
use crate::geometry::ransac::{Config, Found, ransac};
use crate::geometry::usable::flagged;
use crate::sampler::Sampler;
use crate::statistics::{RAYLEIGH_MEDIAN, median};

/// Factor from one threshold to the next narrower one. Small enough for the fit to follow.
const STEP: f64 = 0.6;

/// A model and the matches that agree with it.
#[derive(Debug, Clone)]
pub(in crate::geometry) struct Consensus {
    pub projection: ProjectionMatrix,
    /// The matches within the threshold.
    pub inliers: Vec<bool>,
    /// The matches the model was fitted to, all of them inliers.
    pub support: Vec<bool>,
    /// The threshold of the inliers, normalised.
    pub threshold: f64,
}

impl Consensus {
    /// Of a model fitted to all of its inliers.
    pub fn new(projection: ProjectionMatrix, inliers: Vec<bool>, threshold: f64) -> Self {
        Self { projection, support: inliers.clone(), inliers, threshold }
    }

    /// The number of inliers.
    pub fn count(&self) -> usize {
        count(self.inliers.iter().copied())
    }
}

/// Refinement on the inliers of the search, as in the paper's algorithm 1, and once more on the accurate ones. Without that
/// the model depends on which of the matches near the paper's wide threshold, mostly wrong ones, a sample happens to admit.
pub(in crate::geometry) fn refine_published(
    estimator: ProjectionEstimator,
    points: &Correspondences,
    found: &ProjectionMatrix,
    threshold: f64,
) -> Option<Consensus> {
    let inliers = inliers_of(points, found, threshold);
    let projection = estimator.fit(points, &inliers, Some(found), FINE)?;
    refine_on_accurate(estimator, points, Consensus::new(projection, inliers, threshold))
}

/// From the result of a search at all scales down to the narrowest threshold.
///
/// Two ways lead there: step by step from the widest threshold, which recovers from a bad start, and directly, which admits
/// no wrong matches on the way. The model of the lower cost wins. If the narrowest threshold retains less than three
/// quarters of the inliers of the widest, the next wider one that retains more is used: the model is less accurate than the
/// caller hoped.
pub(in crate::geometry) fn anneal_to_narrowest(
    estimator: ProjectionEstimator,
    points: &Correspondences,
    scales: &Scales,
    found: &ProjectionMatrix,
) -> Option<Consensus> {
    let (wide, narrow) = (scales.widest(), scales.narrowest());
    let most = count(inliers_of(points, found, wide));
    let stepwise = anneal_and_converge(estimator, points, found, wide, narrow);
    let direct = anneal_and_converge(estimator, points, found, narrow, narrow);
    let cost = |way: &Option<Consensus>| {
        way.as_ref().map_or(f64::INFINITY, |c| scales.cost(points, &c.projection, f64::INFINITY))
    };
    let mut chosen = if cost(&direct) < cost(&stepwise) { direct } else { stepwise }?;
    while 4 * chosen.count() < 3 * most && chosen.threshold < wide {
        chosen = anneal_and_converge(estimator, points, found, wide, (chosen.threshold / STEP).min(wide))?;
    }
    refine_on_accurate(estimator, points, chosen)
}

/// Narrows the threshold from `from` to `to`, refitting at each step, and converges there.
fn anneal_and_converge(
    estimator: ProjectionEstimator,
    points: &Correspondences,
    start: &ProjectionMatrix,
    from: f64,
    to: f64,
) -> Option<Consensus> {
    let thresholds = std::iter::successors(Some(from), |threshold| Some(threshold * STEP)).take_while(|t| *t > to);
    let model = anneal(&estimator, points, start, thresholds, 1, COARSE);
    let (projection, inliers) = converge(&estimator, points, &model, to, COARSE)?;
    Some(Consensus::new(projection, inliers, to))
}

/// Fits once more to the inliers within three standard deviations, then selects the inliers again: the few matches near a
/// wide threshold are mostly wrong or at wrong depths, and would have the largest influence.
fn refine_on_accurate(
    estimator: ProjectionEstimator,
    points: &Correspondences,
    consensus: Consensus,
) -> Option<Consensus> {
    let Consensus { projection, inliers, threshold, .. } = consensus;
    let sigma = median(inlier_errors(points, &projection, threshold))?.sqrt() / RAYLEIGH_MEDIAN;
    let narrower = (3.0 * sigma).max(0.01 * threshold).min(threshold);
    let (start, chosen) = match converge(&estimator, points, &projection, narrower, COARSE) {
        Some((model, core)) if 2 * count(core.iter().copied()) > count(inliers.iter().copied()) => (model, core),
        _ => (projection, inliers),
    };
    let projection = estimator.fit(points, &chosen, Some(&start), FINE)?;
    let inliers = inliers_of(points, &projection, threshold);
    let support = chosen.iter().zip(&inliers).map(|(a, b)| *a && *b).collect();
    Some(Consensus { projection, inliers, support, threshold })
}

/// Homographies one after the other, each by RANSAC on the matches that the ones before left over (Zaragoza et al. 2014):
/// flags of all their inliers, and the trials. A homography needs at least `min_inliers(matches left)`.
pub(in crate::geometry) fn homographies(
    points: &Correspondences,
    config: &Config,
    sampler: &mut Sampler,
    min_inliers: impl Fn(usize) -> usize,
) -> (Vec<bool>, u32) {
    /// Most homographies.
    const MOST: usize = 10;
    let estimator = ProjectionEstimator::Homography;
    let mut union = vec![false; points.len()];
    let mut trials = 0;
    for _ in 0..MOST {
        let open: Vec<bool> = union.iter().map(|f| !f).collect();
        let left = flagged(&(0..points.len()).collect::<Vec<_>>(), &open);
        let rest = points.select(&open);
        let all: Vec<usize> = (0..rest.len()).collect();
        let found = ransac(&estimator, &rest, &all, config, sampler, Found::none());
        trials += found.trials;
        let Some(model) = found.model else { break };
        let inliers = inliers_of(&rest, &model, config.scales.narrowest());
        if count(inliers.iter().copied()) < min_inliers(left.len()) {
            break;
        }
        flagged(&left, &inliers).into_iter().for_each(|i| union[i] = true);
    }
    (union, trials)
}
