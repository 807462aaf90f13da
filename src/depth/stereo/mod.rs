//! Epipolar refinement: each pixel's inverse depth is corrected by stereo matching along its epipolar line. Not in the
//! paper; its limitations section (5) names the accuracy of the depth maps.
//!
//! From coarse to fine ([`coarse_to_fine`]): census costs ([`census`]) at steps along the [`epipolar_line`] are aggregated
//! semi-globally ([`semi_global`]); pixels that pass the left–right check are reliable ([`consistency`]), and corrections
//! are extrapolated from them ([`extrapolation`]). At full size gray values refine the result to a fraction of a pixel
//! ([`subpixel`]).

mod census;
mod coarse_to_fine;
mod consistency;
mod epipolar_line;
mod extrapolation;
mod gray;
mod semi_global;
mod subpixel;

use std::borrow::Cow;

use super::holes::{self, Holes};
use crate::geometry::{Model, check_views};
use crate::observer::{Observer, report};
use crate::{Error, InverseDepth, Mask, Result, Stage, View};
use coarse_to_fine::{SearchOptions, Side, coarse_to_fine};
use epipolar_line::EpipolarLines;

/// Least and most pixels that are searched when no range is given. Matches that were no inliers have larger errors than
/// the inliers, and the coarse levels make a wide search cheap. Tuned on the evaluation cases: 6 or 24 at least give 5 to 7 %
/// more visible steps; 12 at most costs 0.9 % of PSNR, 48 gains nothing.
const LEAST_RANGE: f64 = 12.0;
const MOST_RANGE: f64 = 24.0;

/// Options of [`refine`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefineOptions {
    /// Farthest from the prior, in pixels along the epipolar line in the other photo. `None`: four times the prediction
    /// error, from 12 to 24.
    pub range: Option<f64>,
}

/// Refined inverse depth of both photos.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Inverse depth of the target.
    pub target: InverseDepth,
    /// Inverse depth of the reference.
    pub reference: InverseDepth,
    /// Pixels that passed the left–right check: of the target, of the reference.
    pub reliable: [Mask; 2],
    /// How far from the prior was searched, in pixels along the epipolar line.
    pub range: f64,
}

/// How good the depth maps are that a refinement starts from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    /// 90th percentile of the error with which they predict inliers, forward and reverse, in pixels.
    pub error: [f64; 2],
    /// Whether they are interpolated from a few matches, so that any match of pixels is better.
    pub weak: bool,
    /// Whether nothing is wanted of pixels that are not reliable: what is refined there is of no use.
    pub reliable_only: bool,
}

/// Corrects the inverse depth of both photos by stereo matching. The views' depth maps are priors: each pixel is searched for
/// along its epipolar line, ±`range` pixels around its projection by the prior. The cost is census, which exposure does not
/// change, aggregated semi-globally, from coarse to fine; then gray values refine the result to a fraction of a pixel.
/// `prediction_error` is how well the priors predict inliers, forward and reverse, in pixels, such as the 90th percentile
/// of the errors.
///
/// Pixels that pass the left–right check are reliable; corrections are extrapolated from them, but not across the prior's
/// edges, and fade into the prior. Where the prior is not exact, pixels that fail the check but project into the other photo
/// keep their match, unless few are reliable: wrong ones contradict the other map, and void recovery removes them.
/// Holes of the priors are filled from the nearest known pixel, so the refined maps have none, where the priors have
/// any value at all.
///
/// Without parallax in one of the models the priors (0 where none is given) are returned, and no pixel is reliable. Pixels
/// that the whole range of depth moves by less than a pixel keep their prior.
///
/// # Errors
/// `invalid-argument` for a model that needs a depth map it did not get or a range that is no positive number,
/// `size-mismatch`, `out-of-memory`, `aborted`.
pub fn refine(
    target: View<'_>,
    reference: View<'_>,
    forward: &Model,
    reverse: &Model,
    prediction_error: [f64; 2],
    options: &RefineOptions,
    observer: &mut dyn Observer,
) -> Result<Refined> {
    let prior = Prior { error: prediction_error, weak: false, reliable_only: false };
    refine_prior(target, reference, forward, reverse, prior, options, observer)
}

/// [`refine`], from priors that may be weak.
pub(crate) fn refine_prior(
    target: View<'_>,
    reference: View<'_>,
    forward: &Model,
    reverse: &Model,
    prior: Prior,
    options: &RefineOptions,
    observer: &mut dyn Observer,
) -> Result<Refined> {
    check_views(&target, &reference, forward, reverse)?;
    let predicted = prior.error[0].max(prior.error[1]);
    let range = options.range.unwrap_or((4.0 * predicted).clamp(LEAST_RANGE, MOST_RANGE));
    if !(range.is_finite() && range > 0.0) {
        return Err(
            Error::InvalidArgument { name: "range", expected: "a positive number of pixels", value: range }.into()
        );
    }
    report(observer, Stage::Refine, 0.0)?;
    let target_prior = without_holes(&target)?;
    let reference_prior = without_holes(&reference)?;
    if !(forward.has_parallax() && reverse.has_parallax()) {
        let none = |view: &View<'_>| Mask::empty(view.image.width(), view.image.height());
        return Ok(Refined {
            target: target_prior.into_owned(),
            reference: reference_prior.into_owned(),
            reliable: [none(&target)?, none(&reference)?],
            range,
        });
    }
    let sides = [
        Side::new(EpipolarLines::new(forward, &target_prior), &target.image)?,
        Side::new(EpipolarLines::new(reverse, &reference_prior), &reference.image)?,
    ];
    let error = predicted.max(options.range.unwrap_or(0.0) / 6.0);
    let options = SearchOptions {
        range: range as f32,
        // Where there is little texture a prior that is nearly exact is better than any match.
        leaving_cost: (1.75 / error).min(4.0) as u8,
        weak_prior: prior.weak,
        reliable_only: prior.reliable_only,
        // Fine steps are exact, long ones correct more of what the coarser levels got wrong.
        finest: if prior.weak { 1.0 } else { (0.25 * error).clamp(0.5, 1.0) as f32 },
    };
    let [target, reference] = coarse_to_fine(sides, options, observer)?;
    report(observer, Stage::Refine, 1.0)?;
    let reliable = [target.reliable, reference.reliable];
    Ok(Refined { target: target.depth, reference: reference.depth, reliable, range })
}

/// The depth map of a view, its holes filled; 0 everywhere without one.
fn without_holes<'a>(view: &View<'a>) -> Result<Cow<'a, InverseDepth>> {
    match holes::resolve(view.depth, Holes::Nearest)? {
        Some(depth) => Ok(depth),
        None => Ok(Cow::Owned(InverseDepth::constant(0.0, view.image.width(), view.image.height())?)),
    }
}
