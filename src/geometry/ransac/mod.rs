//! One robust estimator for every model: random sampling with the MSAC score, local optimisation and adaptive stopping.
//!
//! What a model is, and how it is fitted, is up to its [`Estimator`]: a homography, the depth model of the paper or a
//! fundamental matrix. [`score`] counts errors, [`local_optimisation`] refits to inliers.

pub(super) mod local_optimisation;
pub(super) mod score;

use super::correspondences::Correspondences;
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
    fn fit_minimal(&self, points: &Correspondences, sample: &[usize]) -> Vec<Self::Model>;

    /// A fast fit to the flagged matches, as local optimisation needs it; `None` if they do not determine a model.
    fn refit(&self, points: &Correspondences, inliers: &[bool], model: &Self::Model) -> Option<Self::Model>;

    /// Non-linear least squares on the flagged matches, from `start` until an iteration reduces the cost by less than the
    /// fraction `tolerance`; `None` if they do not determine a model.
    fn refine(
        &self,
        points: &Correspondences,
        inliers: &[bool],
        start: &Self::Model,
        tolerance: f64,
    ) -> Option<Self::Model>;
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
    fn replace_if_better(
        &mut self,
        estimator: &dyn Estimator<Model = M>,
        points: &Correspondences,
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
    fn inlier_ratio(&self, points: &Correspondences, indices: &[usize], threshold: f64) -> f64 {
        self.model.map_or(0.0, |model| {
            let inliers = inliers_of(points, &model, threshold);
            count(indices.iter().map(|&i| inliers[i])) as f64 / indices.len() as f64
        })
    }
}

/// Draws samples from the matches `population`, scores their models on all of `points`, and returns the best, `start`
/// included. Trials add up.
pub(super) fn ransac<M: Residual + Copy>(
    estimator: &dyn Estimator<Model = M>,
    points: &Correspondences,
    population: &[usize],
    config: &Config,
    sampler: &mut Sampler,
    start: Found<M>,
) -> Found<M> {
    let mut best = start;
    let size = estimator.sample_size();
    if population.len() < size {
        return best;
    }
    let needed =
        |best: &Found<M>| config.trials_needed(best.inlier_ratio(points, population, config.scales.narrowest()), size);
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

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::correspondences::Correspondence;

    /// u = x + a, v = y + b: the simplest model there is, through a single match.
    #[derive(Debug, Clone, Copy, PartialEq)]
    struct Translation([f64; 2]);

    impl Residual for Translation {
        fn squared_error(&self, p: &Correspondence) -> f64 {
            let [dx, dy] = [p.u - p.x - self.0[0], p.v - p.y - self.0[1]];
            dx * dx + dy * dy
        }
    }

    struct TranslationEstimator;

    impl Estimator for TranslationEstimator {
        type Model = Translation;

        fn sample_size(&self) -> usize {
            1
        }

        fn fit_minimal(&self, points: &Correspondences, sample: &[usize]) -> Vec<Translation> {
            sample.iter().map(|&i| Translation([points[i].u - points[i].x, points[i].v - points[i].y])).collect()
        }

        fn refit(&self, points: &Correspondences, inliers: &[bool], _: &Translation) -> Option<Translation> {
            let inliers = points.select(inliers);
            let n = inliers.len() as f64;
            let mean = |shift: fn(&Correspondence) -> f64| inliers.iter().map(shift).sum::<f64>() / n;
            (n > 0.0).then(|| Translation([mean(|p| p.u - p.x), mean(|p| p.v - p.y)]))
        }

        fn refine(
            &self,
            points: &Correspondences,
            inliers: &[bool],
            start: &Translation,
            _: f64,
        ) -> Option<Translation> {
            self.refit(points, inliers, start)
        }
    }

    const TRUE: [f64; 2] = [0.3, -0.2];

    /// 100 matches with noise of at most 0.001, and `outliers` more that are anywhere.
    fn matches(outliers: usize) -> Correspondences {
        let mut random = Sampler::new(7);
        let mut number = || random.below(1 << 20) as f64 / f64::from(1 << 19) - 1.0;
        let mut points = Correspondences::default();
        for i in 0..100 + outliers {
            let ([x, y], [dx, dy]) = ([number(), number()], [number(), number()]);
            let [a, b] = if i < 100 { [TRUE[0] + 0.001 * dx, TRUE[1] + 0.001 * dy] } else { [dx, dy] };
            points.push([x, y], 0.0, [x + a, y + b]);
        }
        points
    }

    const CONFIG: Config = Config {
        scales: Scales([0.04, 0.02, 0.01]),
        confidence: 0.99,
        max_trials: 1000,
        min_trials: 0,
        local_iterations: 5,
    };

    fn search(points: &Correspondences, config: &Config, seed: u32) -> Found<Translation> {
        let all: Vec<usize> = (0..points.len()).collect();
        ransac(&TranslationEstimator, points, &all, config, &mut Sampler::new(seed), Found::none())
    }

    #[test]
    fn the_model_is_found_among_60_percent_outliers() {
        for seed in 0..20 {
            let found = search(&matches(150), &CONFIG, seed);
            let near = |Translation([a, b])| (a - TRUE[0]).abs() < 5e-4 && (b - TRUE[1]).abs() < 5e-4;
            assert!(found.model.is_some_and(near), "{:?}", found.model);
            // ln 0.01 / ln 0.6 is 9.01.
            assert!((1..=60).contains(&found.trials), "{} trials", found.trials);
        }
    }

    #[test]
    fn limits_of_the_trials_are_kept() {
        let points = matches(150);
        for (min_trials, max_trials) in [(0, 1), (0, 3), (40, 1000), (1000, 1000)] {
            let found = search(&points, &Config { min_trials, max_trials, ..CONFIG }, 1);
            assert!((min_trials.max(1)..=max_trials).contains(&found.trials), "{} trials", found.trials);
        }
        // Without outliers one sample is enough.
        assert_eq!(search(&matches(0), &CONFIG, 1).trials, 1);
    }

    #[test]
    fn the_same_seed_gives_the_same_result() {
        let points = matches(150);
        // A single sample, so that the result shows which one it was.
        let config = Config { max_trials: 1, local_iterations: 0, ..CONFIG };
        let run = |seed| search(&points, &config, seed).model;
        assert_eq!(run(3), run(3));
        assert!((4..20).any(|seed| run(seed) != run(3)), "the seed makes no difference");
    }

    #[test]
    fn too_few_matches_give_no_model() {
        let found = search(&Correspondences::default(), &CONFIG, 1);
        assert!(found.model.is_none() && found.cost.is_infinite() && found.trials == 0);
    }

    #[test]
    fn a_better_start_is_kept() {
        let points = matches(150);
        let best = search(&points, &Config { min_trials: 500, ..CONFIG }, 1);
        let again = ransac(&TranslationEstimator, &points, &[120, 130], &CONFIG, &mut Sampler::new(1), best);
        assert_eq!(again.model, best.model);
        assert!(again.trials > best.trials, "trials add up");
    }
}
