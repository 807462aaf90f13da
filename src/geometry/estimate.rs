//! Models of both directions from matches and depth (paper, section 3.1).

use super::epipolar::has_unexplained_parallax;
use super::projection::ProjectionEstimator;
use super::ransac::Estimator;
use super::robust_fit::Fit;
use super::summary::{FEW, check_extent};
use super::usable::{Usable, usable_matches};
use super::{Calibration, Comparison, Estimate, EstimateOptions, Frame, Match, ModelKind, Threshold};
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::{Error, Result, Stage};

/// Fits H∞ and e' in both directions (paper, algorithm 1).
///
/// Returns the homography with e' = 0, and a warning that says why: a frame has no depth, fewer than six matches have
/// depth (or fewer than thirty and less than half of them), parallax is not observable, or ([`Warning::DepthInconsistent`]) the matches do show parallax, but not that of the
/// depth maps.
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
    let mut usable = usable_matches(matches, [&target, &reference]);
    let needed = ProjectionEstimator::Homography.sample_size();
    if usable.len() < needed {
        return Err(Error::TooFewMatches { matches: matches.len(), usable: usable.len(), needed }.into());
    }
    check_extent(&usable)?;

    let with_depth = match matches_with_depth(&usable, &target, &reference) {
        Ok(with_depth) => fit_depth(&with_depth, matches.len(), [target.size, reference.size], options, observer)?,
        Err(warning) => DepthFit::Unusable(warning),
    };
    if let DepthFit::Found(found) = with_depth {
        return Ok(*found);
    }
    usable.iter_mut().for_each(|m| m.depths = [0.0; 2]);
    let mut fit = Fit::new(&usable, options);
    let (consensus, models) = match (fit.homography(observer), &with_depth) {
        // Without depth there is even less agreement.
        (Err(error), DepthFit::NoConsensus(first)) if is_no_consensus(&error) => return Err(first.clone()),
        (found, _) => found?,
    };
    let warning = match with_depth {
        DepthFit::Unusable(warning) => warning,
        DepthFit::NoConsensus(_) => Warning::DepthInconsistent,
        _ if has_unexplained_parallax(&usable, &models[0], options) => Warning::DepthInconsistent,
        _ => Warning::ParallaxUnobservable,
    };
    let mut found = fit.summary(matches.len(), &consensus, models, ModelKind::Homography)?;
    found.warnings.insert(0, warning);
    Ok(found)
}

/// What comes of the depth maps.
enum DepthFit {
    Found(Box<Estimate>),
    /// A homography explains the matches as well as depth does.
    NoParallax,
    /// Too few matches agree with the depth.
    NoConsensus(Box<Error>),
    /// There are no maps, or they have too few values.
    Unusable(Warning),
}

/// The matches with depth at both ends, or why there are not enough.
fn matches_with_depth(
    usable: &[Usable],
    target: &Frame<'_>,
    reference: &Frame<'_>,
) -> std::result::Result<Vec<Usable>, Warning> {
    if target.depth.is_none() || reference.depth.is_none() {
        return Err(Warning::NoDepth);
    }
    let with_depth: Vec<Usable> = usable.iter().filter(|m| m.has_depth()).copied().collect();
    let n = with_depth.len();
    // A few matches with depth do not outweigh many without.
    if n < ProjectionEstimator::Depth.sample_size() || (n < FEW && 2 * n < usable.len()) {
        return Err(Warning::DepthUnusable { usable: n });
    }
    Ok(with_depth)
}

/// The depth model, or the calibrated one where that is better, of `matches` with depth, of `passed` matches.
fn fit_depth(
    matches: &[Usable],
    passed: usize,
    sizes: [(usize, usize); 2],
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<DepthFit> {
    let mut fit = Fit::new(matches, options);
    let (free, models) = match fit.depth(observer) {
        Ok(Some(found)) => found,
        Ok(None) => return Ok(DepthFit::NoParallax),
        Err(error) if is_no_consensus(&error) => return Ok(DepthFit::NoConsensus(error)),
        Err(error) => return Err(error),
    };
    let calibrated = fit.calibrated(&free, &models, sizes);
    report(observer, Stage::Estimate, 0.9)?;
    let comparison = calibrated.as_ref().map(|(_, found)| found.comparison);
    let found = match calibrated {
        Some((consensus, found)) if prefers_calibrated(&found.comparison, options.calibration) => {
            let estimate = fit.summary(passed, &consensus, found.models, ModelKind::Calibrated)?;
            Estimate { focal: Some(found.focal), ..estimate }
        }
        _ => fit.summary(passed, &free, models, ModelKind::Depth)?,
    };
    Ok(DepthFit::Found(Box::new(Estimate { comparison, ..found })))
}

fn prefers_calibrated(comparison: &Comparison, calibration: Calibration) -> bool {
    calibration == Calibration::Always || comparison.calibrated.total() < comparison.free.total()
}

fn is_no_consensus(error: &Error) -> bool {
    matches!(error, Error::NoConsensus { .. })
}

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
        return invalid("focalLength", "a positive number", focal);
    }
    if options.max_trials == 0 {
        return invalid("maxTrials", "at least 1", 0.0);
    }
    Ok(())
}

fn check_depth(name: &'static str, frame: &Frame<'_>) -> Result<()> {
    frame.depth.map_or(Ok(()), |depth| check_size(name, depth.size(), frame.size))
}
