//! Epipolar refinement: each pixel's inverse depth is corrected by matching along its epipolar line.

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
use coarse_to_fine::{Reach, Side, coarse_to_fine};
use epipolar_line::Field;

/// Least and most pixels of motion that are searched when no range is given. Matches that were no inliers miss by more
/// than the inliers do, and the coarse levels make a wide search cheap.
const LEAST_RANGE: f64 = 12.0;
const MOST_RANGE: f64 = 24.0;

/// Options of [`refine`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefineOptions {
    /// Farthest from the prior, in pixels of motion in the other photo. `None`: four times the spread of the residuals,
    /// 12 to 24.
    pub range: Option<f64>,
    /// Whether the priors are but guesses, to be forgotten wherever the photos tell anything.
    pub guess: bool,
}

/// Refined inverse depth of both photos.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Inverse depth of the target.
    pub target: InverseDepth,
    /// Inverse depth of the reference.
    pub reference: InverseDepth,
    /// Where the refinement is believed: in the target, in the reference.
    pub trusted: [Mask; 2],
    /// How far was searched, in pixels of motion.
    pub range: f64,
}

/// Corrects the inverse depth of both photos by what they show. The views' depth maps are priors: each pixel is searched for
/// along its epipolar line, ±`range` pixels around where the prior sends it. The cost is census (exposure plays no part),
/// aggregated semi-globally, from coarse to fine. At last what is found is moved to where the gray values fit best, by a
/// fraction of a pixel. `spread` is how far the priors miss inliers, forward and reverse, in pixels, such as the 90th
/// percentile of the errors.
///
/// A correction is trusted where both maps agree on it. Where they do not, but the other photo is hit, the match stays as
/// it is: if it is wrong, the maps contradict each other and void recovery removes it. Outside the overlap corrections are
/// continued, not across the prior's edges, and fade into the prior; so they are everywhere from what is trusted when that
/// is little.
/// Holes of the priors are filled from the nearest known pixel, so the refined maps have none, where the priors have
/// any value at all.
///
/// Without parallax in one of the models the priors (0 where none is given) come back, and nothing is trusted. Pixels
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
    spread: [f64; 2],
    options: &RefineOptions,
    observer: &mut dyn Observer,
) -> Result<Refined> {
    check_views(&target, &reference, forward, reverse)?;
    let range = options.range.unwrap_or((4.0 * spread[0].max(spread[1])).clamp(LEAST_RANGE, MOST_RANGE));
    if !(range.is_finite() && range > 0.0) {
        return Err(
            Error::InvalidArgument { name: "range", expected: "a positive number of pixels", value: range }.into()
        );
    }
    report(observer, Stage::Refine, 0.0)?;
    let target_prior = prior(&target)?;
    let reference_prior = prior(&reference)?;
    if !(forward.has_parallax() && reverse.has_parallax()) {
        let trusted = [
            Mask::empty(target.image.width(), target.image.height())?,
            Mask::empty(reference.image.width(), reference.image.height())?,
        ];
        return Ok(Refined {
            target: target_prior.into_owned(),
            reference: reference_prior.into_owned(),
            trusted,
            range,
        });
    }
    let sides = [
        Side::new(Field::new(forward, &target_prior), &target.image)?,
        Side::new(Field::new(reverse, &reference_prior), &reference.image)?,
    ];
    // Where little can be seen a prior that is nearly exact is better than any match.
    let error = spread[0].max(spread[1]).max(options.range.unwrap_or(0.0) / 6.0);
    let stay = (1.75 / error).min(4.0) as u8;
    // Fine steps are exact, long ones mend more of what smaller pictures got wrong.
    let finest = if options.guess { 1.0 } else { (0.25 * error).clamp(0.5, 1.0) as f32 };
    let reach = Reach { range: range as f32, stay, guess: options.guess, finest };
    let [target, reference] = coarse_to_fine(sides, reach, observer)?;
    report(observer, Stage::Refine, 1.0)?;
    let trusted = [target.trusted, reference.trusted];
    Ok(Refined { target: target.depth, reference: reference.depth, trusted, range })
}

/// The depth map of a view without holes.
fn prior<'a>(view: &View<'a>) -> Result<Cow<'a, InverseDepth>> {
    match holes::resolve(view.depth, Holes::Nearest)? {
        Some(depth) => Ok(depth),
        None => Ok(Cow::Owned(InverseDepth::constant(0.0, view.image.width(), view.image.height())?)),
    }
}
