//! One robust estimator for every model: random sampling with the MSAC score, local optimisation and adaptive stopping.
//!
//! What a model is, and how it is fitted, is up to its [`Estimator`]: a homography, the depth model of the paper or a
//! fundamental matrix. [`score`] counts errors, [`local_optimisation`] refits to inliers.

pub(super) mod local_optimisation;
pub(super) mod score;

use super::points::Points;
use crate::sampler::Sampler;
use score::{Residual, Scales, count, inliers_of};

/// How to search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Config {
    /// The thresholds of the score. The narrowest defines the inlier ratio.
    pub scales: Scales,
    /// The probability, 0 to 1, that at least one sample is free of outliers when sampling stops.
    pub confidence: f64,
    pub max_trials: u32,
    /// Drawn in any case: a sample without outliers is not yet a good one, and where most matches lie on one plane, so do
    /// most samples.
    pub min_trials: u32,
    /// How often each new best model may be refitted per scale (LO-RANSAC: Chum, Matas & Kittler 2003); 0 is plain RANSAC.
    pub local_iterations: usize,
}

impl Config {
    /// Samples of `k` matches needed to find one without outliers at this inlier ratio (Fischler & Bolles 1981):
    /// ln(1 − confidence) / ln(1 − ratioᵏ). With log1p, as 1 − ratioᵏ rounds to 1 for a small ratio.
    fn trials_needed(&self, ratio: f64, k: usize) -> f64 {
        let (min, max) = (f64::from(self.min_trials), f64::from(self.max_trials));
        let outlier_free = (0..k).fold(1.0, |p, _| p * ratio);
        if outlier_free > 0.0 {
            let needed = libm::log1p(-self.confidence) / libm::log1p(-outlier_free);
            needed.ceil().max(min).min(max)
        } else {
            max
        }
    }
}

/// How a kind of model is fitted.
pub(super) trait Estimator {
    type Model: Residual + Copy;

    /// Matches in a minimal sample.
    fn sample_size(&self) -> usize;

    /// All models through a minimal sample; none if the sample is degenerate.
    fn fit_minimal(&self, points: &Points, sample: &[usize]) -> Vec<Self::Model>;

    /// A fast fit to the flagged matches, as local optimisation needs it; `None` if they do not determine a model.
    fn refit(&self, points: &Points, inliers: &[bool], model: &Self::Model) -> Option<Self::Model>;

    /// Non-linear least squares on the flagged matches, from `start` until an iteration reduces the cost by less than the
    /// fraction `tolerance`; `None` if they do not determine a model.
    fn refine(&self, points: &Points, inliers: &[bool], start: &Self::Model, tolerance: f64) -> Option<Self::Model>;
}

/// The best model so far, if any, its cost, and the number of samples drawn for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found<M> {
    pub model: Option<M>,
    pub cost: f64,
    pub trials: u32,
}

impl<M: Residual + Copy> Found<M> {
    pub fn none() -> Self {
        Self { model: None, cost: f64::INFINITY, trials: 0 }
    }

    /// Replaces the model by a better one, and improves that on its inliers. Returns whether it was better.
    fn replace_if_better<E: Estimator<Model = M>>(
        &mut self,
        estimator: &E,
        points: &Points,
        config: &Config,
        model: M,
    ) -> bool {
        let cost = config.scales.cost(points, &model, self.cost);
        if cost >= self.cost {
            return false;
        }
        let (mut model, mut cost) = (model, cost);
        for threshold in config.scales.0 {
            for _ in 0..config.local_iterations {
                let inliers = inliers_of(points, &model, threshold);
                let Some(refitted) = estimator.refit(points, &inliers, &model) else { break };
                let local_cost = config.scales.cost(points, &refitted, cost);
                if local_cost >= cost {
                    break;
                }
                (model, cost) = (refitted, local_cost);
            }
        }
        (self.model, self.cost) = (Some(model), cost);
        true
    }

    /// The fraction of inliers among the matches `indices`.
    fn inlier_ratio(&self, points: &Points, indices: &[usize], threshold: f64) -> f64 {
        self.model.map_or(0.0, |model| {
            let inliers = inliers_of(points, &model, threshold);
            count(indices.iter().map(|&i| inliers[i])) as f64 / indices.len() as f64
        })
    }
}

/// Draws samples from the matches `population`, scores their models on all of `points`, and returns the best, `start`
/// included. Trials add up.
pub(super) fn ransac<E: Estimator>(
    estimator: &E,
    points: &Points,
    population: &[usize],
    config: &Config,
    sampler: &mut Sampler,
    start: Found<E::Model>,
) -> Found<E::Model> {
    let mut best = start;
    let size = estimator.sample_size();
    if population.len() < size {
        return best;
    }
    let needed = |best: &Found<E::Model>| {
        config.trials_needed(best.inlier_ratio(points, population, config.scales.narrowest()), size)
    };
    let mut limit = needed(&best);
    let mut trials = 0;
    let mut sample = vec![0; size];
    while f64::from(trials) < limit {
        trials += 1;
        sampler.sample(population.len(), &mut sample);
        sample.iter_mut().for_each(|i| *i = population[*i]);
        for model in estimator.fit_minimal(points, &sample) {
            if best.replace_if_better(estimator, points, config, model) {
                limit = needed(&best);
            }
        }
    }
    best.trials += trials;
    best
}
