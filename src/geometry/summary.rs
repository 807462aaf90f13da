//! What the inliers of a fit amount to.

use super::usable::{Usable, standard_deviations};
use super::{Estimate, Model, ModelKind};
use crate::report::Warning;
use crate::statistics::median;
use crate::{Error, Result};

/// With fewer inliers (less than three matches per parameter of the model) a fit deserves a look.
pub(super) const FEW: usize = 30;
/// Correspondences closer to a line than this standard deviation, in pixels, determine no map: features are not localised better.
const MIN_DEVIATION: f64 = 0.5;

/// The estimate of `inlying` matches, `error` being that of a match in the model of a side, if it has one. Threshold and
/// trials are left open.
pub(super) fn summarise(
    inlying: &[Usable],
    models: [Model; 2],
    kind: ModelKind,
    [passed, usable]: [usize; 2],
    error: impl Fn(&Usable, usize) -> Option<f64>,
) -> Estimate {
    let mut inliers = vec![false; passed];
    inlying.iter().for_each(|m| inliers[m.index] = true);
    let [forward, reverse] = models;
    let errors = |side| inlying.iter().map(|m| error(m, side).unwrap_or(f64::INFINITY)).collect();
    Estimate {
        forward,
        reverse,
        inliers,
        kind,
        usable,
        tracked: 0,
        threshold: 0.0,
        trials: 0,
        residual: [0, 1].map(|side| median(errors(side)).unwrap_or(0.0)),
        focal: None,
        comparison: None,
        warnings: consensus_warnings(inlying.len(), usable),
    }
}

fn consensus_warnings(inliers: usize, usable: usize) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if inliers < FEW {
        warnings.push(Warning::FewInliers { inliers });
    }
    if 2 * inliers < usable {
        warnings.push(Warning::LowInlierRatio { ratio: inliers as f64 / usable as f64 });
    }
    warnings
}

/// Refuses matches that lie on one line or in one point of either photo.
pub(super) fn check_extent(matches: &[Usable]) -> Result<()> {
    let deviation = standard_deviations(matches, 0)[0].min(standard_deviations(matches, 1)[0]);
    if deviation < MIN_DEVIATION {
        Err(Error::DegenerateGeometry { matches: matches.len(), deviation }.into())
    } else {
        Ok(())
    }
}
