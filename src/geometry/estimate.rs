//! The robust fit from end to end.

use super::calibration::{Calibrated, calibrate};
use super::clean::{Usable, clean, flagged, spread};
use super::consensus::{Consensus, FINE, Kind, fitted, many_homographies, narrowed, published};
use super::errors::{Scales, count, inliers_of};
use super::parallax::observable;
use super::points::{Normalisation, Points, Projection};
use super::ransac::{Search, msac};
use super::{Calibration, Comparison, Estimate, EstimateOptions, Frame, Match, Model, ModelKind, RobustFit, Threshold};
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::sampler::Sampler;
use crate::statistics::{meaningful_consensus, median};
use crate::{Error, Result, Stage};

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
    let mut usable = clean(matches, [&target, &reference]);
    let least = Kind::Flat.sample();
    if usable.len() < least {
        return Err(Error::TooFewMatches { matches: matches.len(), usable: usable.len(), needed: least }.into());
    }
    check_spread(&usable)?;

    let mut warnings = Vec::new();
    let mut refused = None;
    if target.depth.is_some() && reference.depth.is_some() {
        let deep: Vec<Usable> = flagged(&usable, &usable.iter().map(Usable::has_depth).collect::<Vec<_>>());
        // A few matches with depth do not outweigh many without.
        if deep.len() < Kind::Depth.sample() || (deep.len() < FEW && 2 * deep.len() < usable.len()) {
            warnings.push(Warning::DepthUnusable { usable: deep.len() });
        } else {
            let mut fit = Fit::new(&deep, options);
            match fit.depth(observer) {
                Ok(Some((mut consensus, mut models))) => {
                    let calibrated = fit.calibrated(&consensus, &models, [target.size, reference.size]);
                    report(observer, Stage::Estimate, 0.9)?;
                    let comparison = calibrated.as_ref().map(|(_, c)| c.comparison);
                    let (mut kind, mut focal) = (ModelKind::Depth, None);
                    if let Some((cameras, found)) = calibrated
                        && chosen(&found.comparison, options.calibration)
                    {
                        (consensus, models) = (cameras, found.models);
                        (kind, focal) = (ModelKind::Calibrated, Some(found.focal));
                    }
                    let found = fit.finish(matches.len(), &consensus, models, kind, warnings)?;
                    return Ok(Estimate { focal, comparison, ..found });
                }
                Ok(None) => {}
                Err(error) if matches!(*error, Error::NoConsensus { .. }) => refused = Some(error),
                Err(error) => return Err(error),
            }
            warnings.push(Warning::ParallaxUnobservable);
        }
    } else {
        warnings.push(Warning::NoDepth);
    }
    usable.iter_mut().for_each(|m| m.depths = [0.0; 2]);
    let mut fit = Fit::new(&usable, options);
    let (consensus, models) = fit.homography(observer).map_err(|error| match refused {
        Some(refused) if matches!(*error, Error::NoConsensus { .. }) => refused,
        _ => error,
    })?;
    fit.finish(matches.len(), &consensus, models, ModelKind::Homography, warnings)
}

/// The matches of one fit, in both directions, with what the search needs to know of them.
struct Fit<'a> {
    matches: &'a [Usable],
    options: &'a EstimateOptions,
    sampler: Sampler,
    /// Samples drawn so far.
    trials: u32,
    /// Forward and reverse, in pixels,
    pixels: [Points; 2],
    /// and normalised.
    normalisations: [Normalisation; 2],
    points: [Points; 2],
    /// The user's threshold, normalised.
    threshold: f64,
    /// Area over which wrong matches scatter in the reference, in pixels.
    area: f64,
}

impl<'a> Fit<'a> {
    #[inline(never)]
    fn new(matches: &'a [Usable], options: &'a EstimateOptions) -> Self {
        let mut pixels = [Points::default(), Points::default()];
        for (side, points) in pixels.iter_mut().enumerate() {
            matches.iter().for_each(|m| points.push(m.ends[side], m.depths[side], m.ends[1 - side]));
        }
        let normalisations = [Normalisation::of(&pixels[0]), Normalisation::of(&pixels[1])];
        let points = [normalisations[0].apply(&pixels[0]), normalisations[1].apply(&pixels[1])];
        let threshold = match options.threshold {
            Threshold::Pixels(t) => t * normalisations[0].scale(),
            Threshold::Normalised(t) => t,
        };
        // A rectangle of the same covariance: wrong matches are no more spread than the features are.
        let [narrow, wide] = spread(matches, 1);
        let (sampler, area) = (Sampler::new(options.seed), 12.0 * narrow * wide);
        Self { matches, options, sampler, trials: 0, pixels, normalisations, points, threshold, area }
    }

    /// Normalised units per pixel.
    fn scale(&self) -> f64 {
        self.normalisations[0].scale()
    }

    /// Whether the threshold is one of pixels: it is narrowed down from a wide one, that is.
    fn narrows(&self) -> bool {
        matches!(self.options.threshold, Threshold::Pixels(_))
    }

    fn search(&self) -> Search {
        let wide = if self.narrows() { WIDE } else { self.threshold };
        Search {
            scales: Scales::between(wide, self.threshold),
            confidence: self.options.confidence,
            max_trials: self.options.max_trials,
            local: self.narrows(),
        }
    }

    #[inline(never)]
    fn sampled(&mut self, kind: Kind) -> Option<Projection> {
        let found = msac(&self.points[0], &self.search(), &mut self.sampler, kind)?;
        self.trials += found.trials;
        Some(found.projection)
    }

    #[inline(never)]
    fn completed(&self, found: &Projection, kind: Kind) -> Option<Consensus> {
        if self.narrows() {
            narrowed(&self.points[0], &self.search().scales, found, kind)
        } else {
            published(&self.points[0], found, self.threshold, kind)
        }
    }

    fn consensus(&mut self, kind: Kind) -> Option<Consensus> {
        let found = self.sampled(kind)?;
        self.completed(&found, kind)
    }

    /// The inliers at `threshold` that rule out chance among `n` matches; all of them when even that would prove nothing.
    #[inline(never)]
    fn needed(&self, n: usize, sample: usize, threshold: f64) -> usize {
        let radius = threshold / self.scale();
        let chance = (std::f64::consts::PI * radius * radius / self.area).min(1.0);
        if n <= sample { n.max(sample) } else { meaningful_consensus(n, sample, chance).min(n) }
    }

    #[inline(never)]
    fn believed(&self, consensus: &Consensus, kind: Kind) -> Result<()> {
        let (matches, inliers) = (self.matches.len(), consensus.count());
        let needed = self.needed(matches, kind.sample(), consensus.threshold);
        if inliers < needed { Err(Error::NoConsensus { matches, inliers, needed }.into()) } else { Ok(()) }
    }

    /// The model found and that of the other direction; `None` when the matches do not determine that one.
    fn models(&self, consensus: &Consensus, kind: Kind) -> Option<[Model; 2]> {
        let reverse = fitted(&self.points[1], &consensus.support, None, FINE, kind)?;
        Some([self.normalisations[0].model(&consensus.projection), self.normalisations[1].model(&reverse)])
    }

    /// The depth model in both directions, or `None` when a homography explains the matches as well.
    #[inline(never)]
    fn depth(&mut self, observer: &mut dyn Observer) -> Result<Option<(Consensus, [Model; 2])>> {
        let deep = match self.options.robust_fit {
            RobustFit::Depth => self.consensus(Kind::Depth),
            // The paper's comparisons fit the depth model to the inliers that homographies chose.
            RobustFit::Homography => {
                self.consensus(Kind::Flat).and_then(|flat| self.on_inliers(flat.inliers, flat.threshold))
            }
            RobustFit::MultiHomography => {
                let search = Search { scales: Scales::between(self.threshold, self.threshold), ..self.search() };
                let mut sampler = self.sampler.clone();
                let enough = |left| self.needed(left, Kind::Flat.sample(), self.threshold);
                let (inliers, trials) = many_homographies(&self.points[0], &search, &mut sampler, &enough);
                self.trials += trials;
                self.on_inliers(inliers, self.threshold)
            }
        };
        report(observer, Stage::Estimate, 0.6)?;
        let Some(deep) = deep else { return Ok(None) };
        self.believed(&deep, Kind::Depth)?;
        // With outliers among the inliers, as homographies choose them, a homography would look as good.
        if self.options.robust_fit == RobustFit::Depth
            && let Some(flat) = self.sampled(Kind::Flat)
            && self.flat_suffices(&deep, &flat)
        {
            return Ok(None);
        }
        report(observer, Stage::Estimate, 0.8)?;
        Ok(self.models(&deep, Kind::Depth).map(|models| (deep, models)))
    }

    /// Two calibrated cameras in place of the free models, with their inliers; `None` when fewer matches agree with them
    /// than with chance.
    #[inline(never)]
    fn calibrated(
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
        self.believed(&consensus, Kind::Depth).ok()?;
        Some((consensus, found))
    }

    /// The depth model on inliers that homographies chose.
    fn on_inliers(&self, inliers: Vec<bool>, threshold: f64) -> Option<Consensus> {
        let projection = fitted(&self.points[0], &inliers, None, FINE, Kind::Depth)?;
        Some(Consensus::new(projection, inliers, threshold))
    }

    /// Whether a homography explains the matches as well as the depth model.
    #[inline(never)]
    fn flat_suffices(&self, deep: &Consensus, flat: &Projection) -> bool {
        let points = &self.points[0];
        // So far behind before its refinement, it cannot catch up.
        if 10 * count(&inliers_of(points, flat, deep.threshold)) < 7 * deep.count() {
            return false;
        }
        let flat = self.completed(flat, Kind::Flat).filter(|flat| self.believed(flat, Kind::Flat).is_ok());
        flat.is_some_and(|flat| {
            !observable(points, &deep.inliers, &deep.projection, &flat.projection, self.scale(), self.area)
        })
    }

    #[inline(never)]
    fn homography(&mut self, observer: &mut dyn Observer) -> Result<(Consensus, [Model; 2])> {
        let consensus = self.consensus(Kind::Flat);
        report(observer, Stage::Estimate, 0.8)?;
        let inliers = consensus.as_ref().map_or(0, Consensus::count);
        let refused = Error::NoConsensus { matches: self.matches.len(), inliers, needed: Kind::Flat.sample() };
        let Some(consensus) = consensus else { return Err(refused.into()) };
        self.believed(&consensus, Kind::Flat)?;
        let models = self.models(&consensus, Kind::Flat).ok_or(refused)?;
        Ok((consensus, models))
    }

    #[inline(never)]
    fn finish(
        &self,
        passed: usize,
        consensus: &Consensus,
        models: [Model; 2],
        kind: ModelKind,
        mut warnings: Vec<Warning>,
    ) -> Result<Estimate> {
        let inlying = flagged(self.matches, &consensus.inliers);
        check_spread(&inlying)?;
        let error =
            |m: &Usable, side: usize| transfer_error(&models[side], m.ends[side], m.depths[side], m.ends[1 - side]);
        let found = concluded(&inlying, models, kind, [passed, self.matches.len()], &error);
        warnings.extend(found.warnings);
        let threshold = consensus.threshold / self.scale();
        if consensus.threshold > self.threshold * (1.0 + 1e-9) {
            warnings.push(Warning::ThresholdWidened { threshold });
        }
        Ok(Estimate { threshold, trials: self.trials, warnings, ..found })
    }
}

/// What the inliers among so many matches, passed and usable, tell, `error` being that of a match in the model of a side.
#[inline(never)]
pub(super) fn concluded(
    inlying: &[Usable],
    models: [Model; 2],
    kind: ModelKind,
    [passed, usable]: [usize; 2],
    error: &dyn Fn(&Usable, usize) -> f64,
) -> Estimate {
    let mut inliers = vec![false; passed];
    inlying.iter().for_each(|m| inliers[m.index] = true);
    let [forward, reverse] = models;
    let residual = |side| median(inlying.iter().map(|m| error(m, side)).collect()).unwrap_or(0.0);
    Estimate {
        forward,
        reverse,
        inliers,
        kind,
        usable,
        followed: 0,
        threshold: 0.0,
        trials: 0,
        residual: [residual(0), residual(1)],
        focal: None,
        comparison: None,
        warnings: remarks(inlying.len(), usable),
    }
}

fn chosen(comparison: &Comparison, calibration: Calibration) -> bool {
    calibration == Calibration::Always || comparison.calibrated.total() < comparison.free.total()
}

/// What a person should know of so many inliers.
fn remarks(inliers: usize, usable: usize) -> Vec<Warning> {
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

#[inline(never)]
fn check(options: &EstimateOptions) -> Result<()> {
    let (Threshold::Pixels(threshold) | Threshold::Normalised(threshold)) = options.threshold;
    let invalid = |name, expected, value| Err(Error::InvalidArgument { name, expected, value }.into());
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

#[inline(never)]
fn check_spread(matches: &[Usable]) -> Result<()> {
    let spread = spread(matches, 0)[0].min(spread(matches, 1)[0]);
    if spread < LEAST_SPREAD {
        Err(Error::DegenerateGeometry { matches: matches.len(), spread }.into())
    } else {
        Ok(())
    }
}
