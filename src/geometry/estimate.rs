//! The robust fit from end to end.

use super::calibration::{Calibrated, calibrate};
use super::clean::{Usable, clean, spread};
use super::consensus::{Consensus, FINE, Kind, fitted, many_homographies, narrowed, published, sampled};
use super::errors::{Scales, count, inliers_of};
use super::parallax::observable;
use super::points::{Normalisation, Points};
use super::ransac::Search;
use super::sampler::Sampler;
use super::statistics::{meaningful_consensus, median};
use super::{Calibration, Comparison, Estimate, EstimateOptions, Frame, Match, Model, ModelKind, RobustFit, Threshold};
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::{Error, Result, Stage};

/// Matches that fix a depth model, and a homography.
const DEPTH_SAMPLE: usize = 6;
const FLAT_SAMPLE: usize = 4;
/// Below it (less than three matches per number of the model) the fit is worth a look.
pub(super) const FEW: usize = 30;
/// Points closer to a line than this standard deviation, in pixels, determine no map: features are not localised better.
const LEAST_SPREAD: f64 = 0.5;
/// The paper's threshold, where the search for a narrow consensus starts.
const WIDE: f64 = 0.1;

/// Fits H∞ and e' in both directions (paper, algorithm 1).
///
/// Returns the homography with e' = 0, and a warning that says so, when a frame has no depth, when fewer than six matches
/// have depth, or when parallax is not observable.
///
/// # Errors
/// `invalid-argument`, `size-mismatch` for a depth map of another size than its frame, `too-few-matches`, `no-consensus`,
/// `degenerate-geometry`, `aborted`.
pub fn estimate(
    matches: &[Match],
    target: Frame<'_>,
    reference: Frame<'_>,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<Estimate> {
    check(options)?;
    check_depth("targetDepth", &target)?;
    check_depth("referenceDepth", &reference)?;
    report(observer, Stage::Estimate, 0.0)?;
    let usable = clean(matches, &target, &reference);
    if usable.len() < FLAT_SAMPLE {
        return Err(Error::TooFewMatches { matches: matches.len(), usable: usable.len(), needed: FLAT_SAMPLE });
    }
    check_spread(&usable)?;

    let mut warnings = Vec::new();
    let mut refused = None;
    if target.depth.is_some() && reference.depth.is_some() {
        let deep: Vec<Usable> = usable.iter().copied().filter(Usable::has_depth).collect();
        // A few matches with depth do not outweigh many without.
        if deep.len() < DEPTH_SAMPLE || (deep.len() < FEW && 2 * deep.len() < usable.len()) {
            warnings.push(Warning::DepthUnusable { usable: deep.len() });
        } else {
            let fit = Fit::new(&deep, options);
            match fit.depth(options, observer) {
                Ok(Some((mut consensus, mut models))) => {
                    let sizes = [target.size, reference.size];
                    let calibrated = fit.calibrated(&consensus, &models, sizes, options);
                    report(observer, Stage::Estimate, 0.9)?;
                    let comparison = calibrated.as_ref().map(|(_, c)| c.comparison);
                    let (mut kind, mut focal) = (ModelKind::Depth, None);
                    if let Some((cameras, found)) = calibrated
                        && chosen(&found.comparison, options.calibration)
                    {
                        (consensus, models) = (cameras, found.models);
                        (kind, focal) = (ModelKind::Calibrated, Some(found.focal));
                    }
                    let found = fit.finish(matches.len(), consensus, models, kind, warnings)?;
                    return Ok(Estimate { focal, comparison, ..found });
                }
                Ok(None) => {}
                Err(error @ Error::NoConsensus { .. }) => refused = Some(error),
                Err(error) => return Err(error),
            }
            warnings.push(Warning::ParallaxUnobservable);
        }
    } else {
        warnings.push(Warning::NoDepth);
    }
    let flat: Vec<Usable> = usable.iter().map(|m| Usable { target_depth: 0.0, reference_depth: 0.0, ..*m }).collect();
    let fit = Fit::new(&flat, options);
    let (consensus, models) = fit.homography(options, observer).map_err(|error| match error {
        Error::NoConsensus { .. } => refused.unwrap_or(error),
        other => other,
    })?;
    fit.finish(matches.len(), consensus, models, ModelKind::Homography, warnings)
}

/// The matches of one fit, in both directions, with what the search needs to know of them.
struct Fit<'a> {
    matches: &'a [Usable],
    /// Forward and reverse, in pixels.
    pixels: [Points; 2],
    forward: (Normalisation, Points),
    reverse: (Normalisation, Points),
    /// The user's threshold, normalised, and the same in pixels.
    threshold: f64,
    /// Area over which wrong matches scatter in the reference, in pixels.
    area: f64,
}

impl<'a> Fit<'a> {
    fn new(matches: &'a [Usable], options: &EstimateOptions) -> Self {
        let (mut forward, mut reverse) = (Points::default(), Points::default());
        for m in matches {
            forward.push(m.target, m.target_depth, m.reference);
            reverse.push(m.reference, m.reference_depth, m.target);
        }
        let pixels = [forward, reverse];
        let [forward, reverse] = [0, 1].map(|k| {
            let normalisation = Normalisation::of(&pixels[k]);
            (normalisation, normalisation.apply(&pixels[k]))
        });
        let threshold = match options.threshold {
            Threshold::Pixels(t) => t * forward.0.scale(),
            Threshold::Normalised(t) => t,
        };
        // A rectangle of the same covariance: wrong matches are no more spread than the features are.
        let [narrow, wide] = spread(matches.iter().map(|m| m.reference));
        Self { matches, pixels, forward, reverse, threshold, area: 12.0 * narrow * wide }
    }

    fn search(&self, options: &EstimateOptions) -> Search {
        let scales = match options.threshold {
            Threshold::Pixels(_) => Scales::between(WIDE, self.threshold),
            Threshold::Normalised(t) => Scales::between(t, t),
        };
        Search {
            scales,
            confidence: options.confidence,
            max_trials: options.max_trials,
            local: matches!(options.threshold, Threshold::Pixels(_)),
        }
    }

    fn consensus(&self, options: &EstimateOptions, sampler: &mut Sampler, kind: Kind) -> Option<Consensus> {
        self.completed(options, sampled(&self.forward.1, &self.search(options), sampler, kind)?, kind)
    }

    fn completed(&self, options: &EstimateOptions, found: Consensus, kind: Kind) -> Option<Consensus> {
        match options.threshold {
            Threshold::Pixels(_) => narrowed(&self.forward.1, &self.search(options).scales, found, kind),
            Threshold::Normalised(_) => published(&self.forward.1, found, kind),
        }
    }

    /// The inliers at `threshold` that rule out chance among `n` matches; all of them when even that would prove nothing.
    fn needed(&self, n: usize, sample: usize, threshold: f64) -> usize {
        let radius = threshold / self.forward.0.scale();
        let chance = (std::f64::consts::PI * radius * radius / self.area).min(1.0);
        if n <= sample { n.max(sample) } else { meaningful_consensus(n, sample, chance).min(n) }
    }

    fn believed(&self, consensus: &Consensus, sample: usize) -> Result<()> {
        let (matches, inliers) = (self.matches.len(), consensus.count());
        let needed = self.needed(matches, sample, consensus.threshold);
        if inliers < needed { Err(Error::NoConsensus { matches, inliers, needed }) } else { Ok(()) }
    }

    /// The depth model in both directions, or `None` when a homography explains the matches as well.
    fn depth(&self, options: &EstimateOptions, observer: &mut dyn Observer) -> Result<Option<(Consensus, [Model; 2])>> {
        let points = &self.forward.1;
        let mut sampler = Sampler::new(options.seed);
        let deep = match options.robust_fit {
            RobustFit::Depth => self.consensus(options, &mut sampler, Kind::Depth),
            RobustFit::Homography => self
                .consensus(options, &mut sampler, Kind::Flat)
                .and_then(|flat| self.on_inliers(flat.inliers, flat.threshold, flat.trials)),
            RobustFit::MultiHomography => {
                let search = Search { scales: Scales::between(self.threshold, self.threshold), ..self.search(options) };
                let enough = |left| self.needed(left, FLAT_SAMPLE, self.threshold);
                let (inliers, trials) = many_homographies(points, &search, &mut sampler, enough);
                self.on_inliers(inliers, self.threshold, trials)
            }
        };
        report(observer, Stage::Estimate, 0.6)?;
        let Some(mut deep) = deep else { return Ok(None) };
        self.believed(&deep, DEPTH_SAMPLE)?;
        // The paper's comparisons fit the depth model to whatever inliers they chose, outliers included, and those would
        // make a homography look as good.
        if options.robust_fit == RobustFit::Depth
            && let Some(flat) = sampled(points, &self.search(options), &mut sampler, Kind::Flat)
        {
            deep.trials += flat.trials;
            if self.flat_suffices(&deep, flat, options) {
                return Ok(None);
            }
        }
        report(observer, Stage::Estimate, 0.8)?;
        let reverse = fitted(&self.reverse.1, &deep.support, None, FINE, Kind::Depth);
        Ok(reverse.map(|reverse| {
            let models = [self.forward.0.model(&deep.projection), self.reverse.0.model(&reverse)];
            (deep, models)
        }))
    }

    /// Two calibrated cameras in place of the free models, with their inliers; `None` when fewer matches agree with them
    /// than with chance.
    fn calibrated(
        &self,
        free: &Consensus,
        models: &[Model; 2],
        sizes: [(usize, usize); 2],
        options: &EstimateOptions,
    ) -> Option<(Consensus, Calibrated)> {
        if options.calibration == Calibration::Off {
            return None;
        }
        let found = calibrate(
            &self.pixels,
            &free.inliers,
            sizes,
            models,
            free.threshold / self.forward.0.scale(),
            options.focal,
        )?;
        let projection = self.forward.0.projection(&found.models[0]);
        let inliers = inliers_of(&self.forward.1, &projection, free.threshold);
        let consensus = Consensus { projection, support: inliers.clone(), inliers, ..*free };
        self.believed(&consensus, DEPTH_SAMPLE).ok()?;
        Some((consensus, found))
    }

    /// The depth model on inliers that homographies chose.
    fn on_inliers(&self, inliers: Vec<bool>, threshold: f64, trials: u32) -> Option<Consensus> {
        let projection = fitted(&self.forward.1, &inliers, None, FINE, Kind::Depth)?;
        Some(Consensus { projection, support: inliers.clone(), inliers, threshold, trials })
    }

    /// Whether a homography explains the matches as well as the depth model.
    fn flat_suffices(&self, deep: &Consensus, flat: Consensus, options: &EstimateOptions) -> bool {
        let (points, normalisation) = (&self.forward.1, &self.forward.0);
        // So far behind before its refinement, it cannot catch up.
        if 10 * count(&inliers_of(points, &flat.projection, deep.threshold)) < 7 * deep.count() {
            return false;
        }
        let flat = self.completed(options, flat, Kind::Flat).filter(|flat| self.believed(flat, FLAT_SAMPLE).is_ok());
        flat.is_some_and(|flat| {
            !observable(points, &deep.inliers, &deep.projection, &flat.projection, normalisation.scale())
        })
    }

    fn homography(&self, options: &EstimateOptions, observer: &mut dyn Observer) -> Result<(Consensus, [Model; 2])> {
        let matches = self.matches.len();
        let consensus = self.consensus(options, &mut Sampler::new(options.seed), Kind::Flat);
        report(observer, Stage::Estimate, 0.8)?;
        let consensus = consensus.ok_or(Error::NoConsensus { matches, inliers: 0, needed: FLAT_SAMPLE })?;
        self.believed(&consensus, FLAT_SAMPLE)?;
        let reverse = fitted(&self.reverse.1, &consensus.support, None, FINE, Kind::Flat)
            .ok_or(Error::NoConsensus { matches, inliers: consensus.count(), needed: FLAT_SAMPLE })?;
        let models = [self.forward.0.model(&consensus.projection), self.reverse.0.model(&reverse)];
        Ok((consensus, models))
    }

    fn finish(
        &self,
        passed: usize,
        consensus: Consensus,
        [forward, reverse]: [Model; 2],
        kind: ModelKind,
        mut warnings: Vec<Warning>,
    ) -> Result<Estimate> {
        let inlying: Vec<Usable> =
            self.matches.iter().zip(&consensus.inliers).filter(|(_, f)| **f).map(|(m, _)| *m).collect();
        check_spread(&inlying)?;
        let (inliers, usable) = (count(&consensus.inliers), self.matches.len());
        warnings.extend(remarks(inliers, usable));
        let threshold = consensus.threshold / self.forward.0.scale();
        if consensus.threshold > self.threshold * (1.0 + 1e-9) {
            warnings.push(Warning::ThresholdWidened { threshold });
        }
        let mut flags = vec![false; passed];
        for m in &inlying {
            flags[m.index] = true;
        }
        let residual = [
            median(inlying.iter().map(|m| transfer_error(&forward, m.target, m.target_depth, m.reference)).collect()),
            median(
                inlying.iter().map(|m| transfer_error(&reverse, m.reference, m.reference_depth, m.target)).collect(),
            ),
        ]
        .map(|r| r.unwrap_or(0.0));
        Ok(Estimate {
            forward,
            reverse,
            inliers: flags,
            kind,
            usable,
            threshold,
            trials: consensus.trials,
            residual,
            focal: None,
            comparison: None,
            warnings,
        })
    }
}

fn chosen(comparison: &Comparison, calibration: Calibration) -> bool {
    calibration == Calibration::Always || comparison.calibrated.total() < comparison.free.total()
}

/// What a person should know of so many inliers.
pub(super) fn remarks(inliers: usize, usable: usize) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if inliers < FEW {
        warnings.push(Warning::FewInliers { inliers });
    }
    if 2 * inliers < usable {
        warnings.push(Warning::LowInlierRatio { ratio: inliers as f64 / usable as f64 });
    }
    warnings
}

fn transfer_error(model: &Model, [x, y]: [f64; 2], d: f64, [u, v]: [f64; 2]) -> f64 {
    model.project(x, y, d).map_or(f64::INFINITY, |[a, b]| ((a - u) * (a - u) + (b - v) * (b - v)).sqrt())
}

fn check(options: &EstimateOptions) -> Result<()> {
    let (Threshold::Pixels(threshold) | Threshold::Normalised(threshold)) = options.threshold;
    let invalid = |name, expected, value| Err(Error::InvalidArgument { name, expected, value });
    if !(threshold > 0.0 && threshold.is_finite()) {
        return invalid("threshold", "a positive number", threshold);
    }
    if !(options.confidence > 0.0 && options.confidence < 1.0) {
        return invalid("confidence", "between 0 and 1", options.confidence);
    }
    if let Some(focal) = options.focal
        && !(focal > 0.0 && focal.is_finite())
    {
        return invalid("focal", "a positive number", focal);
    }
    if options.max_trials == 0 {
        return invalid("maxTrials", "at least 1", 0.0);
    }
    Ok(())
}

fn check_depth(name: &'static str, frame: &Frame<'_>) -> Result<()> {
    frame.depth.map_or(Ok(()), |depth| check_size(name, (depth.width(), depth.height()), frame.size))
}

fn check_spread(matches: &[Usable]) -> Result<()> {
    let [target, _] = spread(matches.iter().map(|m| m.target));
    let [reference, _] = spread(matches.iter().map(|m| m.reference));
    let spread = target.min(reference);
    if spread < LEAST_SPREAD { Err(Error::DegenerateGeometry { matches: matches.len(), spread }) } else { Ok(()) }
}
