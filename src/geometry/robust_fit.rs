//! The robust fit of one set of matches: search, inliers, and the models of both directions.

use super::calibrated::{Calibrated, calibrate};
use super::correspondences::{Correspondences, ProjectionMatrix};
use super::normalisation::Normalisation;
use super::projection::{
    Consensus, FINE, ProjectionEstimator, anneal_to_narrowest, homographies, parallax_observable, refine_published,
};
use super::ransac::score::{Scales, count, inliers_of};
use super::ransac::{Config, Estimator, Found, ransac};
use super::summary::{check_extent, summarise};
use super::usable::{Usable, flagged, scatter_area};
use super::{Calibration, Estimate, EstimateOptions, Model, ModelKind, RobustFit, Threshold};
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::sampler::Sampler;
use crate::statistics::meaningful_consensus;
use crate::{Error, Result, Stage};

/// The paper's threshold, in normalised coordinates: where the search for a narrower consensus starts.
const WIDE: f64 = 0.1;
/// Samples drawn in any case; together they take well under a millisecond.
const MIN_TRIALS: u32 = 300;
/// Local optimisation continues while the cost falls, which is a few times.
const LOCAL_ITERATIONS: usize = 50;
/// A homography with less than this fraction of the depth model's inliers before its refinement cannot be as good after it.
const COMPARABLE: f64 = 0.7;

/// The matches of one fit, in both directions, with what the search needs to know of them.
pub(super) struct Fit<'a> {
    matches: &'a [Usable],
    options: &'a EstimateOptions,
    sampler: Sampler,
    /// Samples drawn so far.
    trials: u32,
    /// Forward and reverse, in pixels,
    pixels: [Correspondences; 2],
    /// and normalised.
    normalisations: [Normalisation; 2],
    points: [Correspondences; 2],
    /// The user's threshold, normalised.
    threshold: f64,
    /// Area over which outliers are spread in the reference, in pixels.
    area: f64,
}

impl<'a> Fit<'a> {
    pub fn new(matches: &'a [Usable], options: &'a EstimateOptions) -> Self {
        let mut pixels = [Correspondences::default(), Correspondences::default()];
        for (side, points) in pixels.iter_mut().enumerate() {
            matches.iter().for_each(|m| points.push(m.ends[side], m.depths[side], m.ends[1 - side]));
        }
        let normalisations = [Normalisation::hartley(&pixels[0]), Normalisation::hartley(&pixels[1])];
        let points = [normalisations[0].apply(&pixels[0]), normalisations[1].apply(&pixels[1])];
        let threshold = match options.threshold {
            Threshold::Pixels(t) => t * normalisations[0].scale(),
            Threshold::Normalised(t) => t,
        };
        let (sampler, area) = (Sampler::new(options.seed), scatter_area(matches));
        Self { matches, options, sampler, trials: 0, pixels, normalisations, points, threshold, area }
    }

    /// Normalised units per pixel.
    fn scale(&self) -> f64 {
        self.normalisations[0].scale()
    }

    /// Whether the threshold is in pixels, and so is reached by annealing from a wide one.
    fn anneals(&self) -> bool {
        matches!(self.options.threshold, Threshold::Pixels(_))
    }

    fn config(&self) -> Config {
        let wide = if self.anneals() { WIDE } else { self.threshold };
        Config {
            scales: Scales::between(wide, self.threshold),
            confidence: self.options.confidence,
            max_trials: self.options.max_trials,
            min_trials: MIN_TRIALS,
            local_iterations: if self.anneals() { LOCAL_ITERATIONS } else { 0 },
        }
    }

    /// The best model of a random search.
    fn search(&mut self, estimator: ProjectionEstimator) -> Option<ProjectionMatrix> {
        let (config, points) = (self.config(), &self.points[0]);
        let all: Vec<usize> = (0..points.len()).collect();
        let found = ransac(&estimator, points, &all, &config, &mut self.sampler, Found::none());
        self.trials += found.trials;
        found.model
    }

    /// The inliers of a model that a search found, and the model refined on them.
    fn refine(&self, found: &ProjectionMatrix, estimator: ProjectionEstimator) -> Option<Consensus> {
        if self.anneals() {
            anneal_to_narrowest(estimator, &self.points[0], &self.config().scales, found)
        } else {
            refine_published(estimator, &self.points[0], found, self.threshold)
        }
    }

    fn consensus(&mut self, estimator: ProjectionEstimator) -> Option<Consensus> {
        let found = self.search(estimator)?;
        self.refine(&found, estimator)
    }

    /// The inliers at `threshold` that rule out chance among `n` matches; all of them if even that would prove nothing.
    fn needed(&self, n: usize, sample: usize, threshold: f64) -> usize {
        let radius = threshold / self.scale();
        let chance = (std::f64::consts::PI * radius * radius / self.area).min(1.0);
        if n <= sample { n.max(sample) } else { meaningful_consensus(n, sample, chance).min(n) }
    }

    /// Refuses a consensus that chance explains.
    fn check_meaningful(&self, consensus: &Consensus, estimator: ProjectionEstimator) -> Result<()> {
        let (matches, inliers) = (self.matches.len(), consensus.count());
        let needed = self.needed(matches, estimator.sample_size(), consensus.threshold);
        if inliers < needed { Err(Error::NoConsensus { matches, inliers, needed }.into()) } else { Ok(()) }
    }

    /// The model found and that of the other direction; `None` if the matches do not determine that one.
    fn models(&self, consensus: &Consensus, estimator: ProjectionEstimator) -> Option<[Model; 2]> {
        let reverse = estimator.fit(&self.points[1], &consensus.support, None, FINE)?;
        Some([self.normalisations[0].model(&consensus.projection), self.normalisations[1].model(&reverse)])
    }

    /// The depth model in both directions, or `None` if no sample determines one or a homography explains the matches as
    /// well.
    pub fn depth(&mut self, observer: &mut dyn Observer) -> Result<Option<(Consensus, [Model; 2])>> {
        let found = match self.options.robust_fit {
            RobustFit::Depth => self.consensus(ProjectionEstimator::Depth),
            // The paper's comparisons fit the depth model to the inliers of homographies.
            RobustFit::Homography => self
                .consensus(ProjectionEstimator::Homography)
                .and_then(|homography| self.depth_of_inliers(homography.inliers, homography.threshold)),
            RobustFit::MultiHomography => {
                let config = Config { scales: Scales::between(self.threshold, self.threshold), ..self.config() };
                let mut sampler = self.sampler.clone();
                let sample = ProjectionEstimator::Homography.sample_size();
                let needed = |left| self.needed(left, sample, self.threshold);
                let (inliers, trials) = homographies(&self.points[0], &config, &mut sampler, needed);
                self.trials += trials;
                self.depth_of_inliers(inliers, self.threshold)
            }
        };
        report(observer, Stage::Estimate, 0.6)?;
        let Some(found) = found else { return Ok(None) };
        self.check_meaningful(&found, ProjectionEstimator::Depth)?;
        // With outliers among the inliers, as homographies select them, a homography would look as good.
        if self.options.robust_fit == RobustFit::Depth
            && let Some(homography) = self.search(ProjectionEstimator::Homography)
            && self.homography_suffices(&found, &homography)
        {
            return Ok(None);
        }
        report(observer, Stage::Estimate, 0.8)?;
        Ok(self.models(&found, ProjectionEstimator::Depth).map(|models| (found, models)))
    }

    /// The depth model on inliers that homographies selected.
    fn depth_of_inliers(&self, inliers: Vec<bool>, threshold: f64) -> Option<Consensus> {
        let projection = ProjectionEstimator::Depth.fit(&self.points[0], &inliers, None, FINE)?;
        Some(Consensus::new(projection, inliers, threshold))
    }

    /// Whether a homography explains the matches as well as the depth model.
    fn homography_suffices(&self, depth: &Consensus, homography: &ProjectionMatrix) -> bool {
        let points = &self.points[0];
        let inliers = count(inliers_of(points, homography, depth.threshold));
        if (inliers as f64) < COMPARABLE * depth.count() as f64 {
            return false;
        }
        self.refine(homography, ProjectionEstimator::Homography)
            .filter(|found| self.check_meaningful(found, ProjectionEstimator::Homography).is_ok())
            .is_some_and(|found| {
                let (with, without) = (&depth.projection, &found.projection);
                !parallax_observable(points, &depth.inliers, with, without, self.scale(), self.area)
            })
    }

    /// Two calibrated cameras in place of the free models, with their inliers; `None` if chance explains those.
    pub fn calibrated(
        &self,
        free: &Consensus,
        models: &[Model; 2],
        sizes: [(usize, usize); 2],
    ) -> Option<(Consensus, Calibrated)> {
        if self.options.calibration == Calibration::Off {
            return None;
        }
        let threshold = free.threshold / self.scale();
        let found = calibrate(&self.pixels, &free.inliers, sizes, models, threshold, self.options.focal)?;
        let projection = self.normalisations[0].projection(&found.models[0]);
        let inliers = inliers_of(&self.points[0], &projection, free.threshold);
        let consensus = Consensus::new(projection, inliers, free.threshold);
        self.check_meaningful(&consensus, ProjectionEstimator::Depth).ok()?;
        Some((consensus, found))
    }

    pub fn homography(&mut self, observer: &mut dyn Observer) -> Result<(Consensus, [Model; 2])> {
        let estimator = ProjectionEstimator::Homography;
        let consensus = self.consensus(estimator);
        report(observer, Stage::Estimate, 0.8)?;
        let inliers = consensus.as_ref().map_or(0, Consensus::count);
        let refused = Error::NoConsensus { matches: self.matches.len(), inliers, needed: estimator.sample_size() };
        let Some(consensus) = consensus else { return Err(refused.into()) };
        self.check_meaningful(&consensus, estimator)?;
        let models = self.models(&consensus, estimator).ok_or(refused)?;
        Ok((consensus, models))
    }

    /// The estimate of a consensus, of so many matches `passed`.
    ///
    /// # Errors
    /// `degenerate-geometry` if the inliers lie on one line or in one point.
    pub fn summary(
        &self,
        passed: usize,
        consensus: &Consensus,
        models: [Model; 2],
        kind: ModelKind,
    ) -> Result<Estimate> {
        let inlying = flagged(self.matches, &consensus.inliers);
        check_extent(&inlying)?;
        let error =
            |m: &Usable, side: usize| models[side].transfer_error(m.ends[side], m.depths[side], m.ends[1 - side]);
        let mut found = summarise(&inlying, models, kind, [passed, self.matches.len()], error);
        found.threshold = consensus.threshold / self.scale();
        found.trials = self.trials;
        // More than rounding.
        if consensus.threshold > self.threshold * (1.0 + 1e-9) {
            found.warnings.push(Warning::ThresholdWidened { threshold: found.threshold });
        }
        Ok(found)
    }
}
