//! The models of a set of matches, and the inverse-depth maps that go with them.

use std::borrow::Cow;

use super::align::Alignment;
use super::options::{Options, WithoutDepth};
use super::picture::share_of_points;
use crate::depth::{SECOND_MAP, derive_missing, reference_map, target_map};
use crate::features::track;
use crate::geometry::{Estimate, EstimateOptions, Frame, Match, ModelKind, estimate, two_view_geometry};
use crate::observer::{Observer, Portion};
use crate::report::Warning;
use crate::{Error, ImageView, InverseDepth, Result, Stage, View};

/// Of the inliers of one direction, the least share that must be inliers of the other direction as well.
const CONSISTENT_SHARE: f64 = 0.5;
/// Their threshold, as a multiple of the first direction's: the reverse model is fitted to inliers of the forward one.
const REVERSE_TOLERANCE: f64 = 3.0;

/// With more of the target behind the reference's camera than this, models are wrong: two photos of a wide lens, 100°, that overlap by a
/// quarter have two fifths of the target there. Of some 200 real pairs without depth maps the most was 2 %.
const MOST_BEHIND: f64 = 0.5;
/// How many other samples they are fitted by then.
const ATTEMPTS: u32 = 8;

/// Fits the models to the matches: with the depth maps of the views where they fit the matches,
/// otherwise with depth from the matches themselves. Where few matches agree, they may do so on a map that turns most of the
/// target behind the reference's camera: then other samples are tried.
///
/// # Errors
/// `degenerate-geometry` if all of them do; those of the fits.
pub(super) fn fit_models<'a>(
    matches: &[Match],
    views: [View<'a>; 2],
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let mut seed = options.estimate.seed;
    let first = fit(matches, views, options, seed, observer)?;
    let behind = first.share_behind(views[0].image);
    if behind <= MOST_BEHIND {
        return Ok(first);
    }
    for _ in 0..ATTEMPTS {
        seed = seed.wrapping_add(1);
        // The map that is completed later is the rest of the stage, if there is any.
        let done = if first.missing.is_some() { SECOND_MAP } else { 1.0 };
        let again = &mut Portion::of_stage(observer, first.stage(), done, done);
        if let Some(found) = if_possible(fit(matches, views, options, seed, again))?
            && found.share_behind(views[0].image) <= MOST_BEHIND
        {
            return Ok(found);
        }
    }
    Err(Error::BehindCamera { behind }.into())
}

/// As [`fit_models`] with this seed, wherever the target is.
fn fit<'a>(
    matches: &[Match],
    views: [View<'a>; 2],
    options: &Options,
    seed: u32,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let without_depth = options.without_depth;
    let options = &EstimateOptions { seed, ..options.estimate.clone() };
    let given = views.map(|view| view.depth.is_some());
    if without_depth == WithoutDepth::Homography {
        return fit_to_maps(matches, views, without_depth, options, observer);
    }
    if given == [false; 2] {
        return fit_two_view(matches, views, options, 0.0, observer);
    }
    let first = match fit_to_maps(matches, views, without_depth, options, &mut Portion::new(observer, 0.0, 0.5)) {
        Ok(found) if found.maps_fit(matches) => return Ok(found),
        Err(error) if !matches!(*error, Error::NoConsensus { .. }) => return Err(error),
        other => other,
    };
    // A homography may be all there is to find; but depth maps that are wrong hide parallax just as well.
    let unusable = first.as_ref().ok().and_then(|first| {
        first.geometry.warnings.iter().find(|warning| matches!(warning, Warning::DepthUnusable { .. })).cloned()
    });
    let ignoring = |mut found: Alignment<'a>| {
        found.geometry.warnings.insert(0, unusable.clone().unwrap_or(Warning::DepthInconsistent));
        found
    };
    let without = if_possible(fit_two_view(matches, views, options, 0.5, observer))?;
    let flat = |found: &Alignment<'_>| found.geometry.kind == ModelKind::Homography;
    match without {
        Some(found) if !flat(&found) || !first.as_ref().is_ok_and(flat) => Ok(ignoring(found)),
        // One map may have been given, from which no other could be made.
        _ => first.map(|found| Alignment { geometry: found.geometry.without_parallax(), ..found }),
    }
}

/// What an attempt gives that may fail for want of a model: only what would end any other attempt as well is an error.
pub(super) fn if_possible<T>(attempt: Result<T>) -> Result<Option<T>> {
    match attempt {
        Ok(found) => Ok(Some(found)),
        Err(error) => match *error {
            Error::NoConsensus { .. }
            | Error::TooFewMatches { .. }
            | Error::DegenerateGeometry { .. }
            | Error::BehindCamera { .. } => Ok(None),
            _ => Err(error),
        },
    }
}

/// The models with depth from the matches themselves; that of the reference [comes later](Alignment::complete_maps). `from` is the
/// share of the estimation that was done before.
fn fit_two_view<'a>(
    matches: &[Match],
    [target, reference]: [View<'a>; 2],
    options: &EstimateOptions,
    from: f32,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let sizes = [target, reference].map(|view| view.image.size());
    let found = two_view_geometry(matches, sizes, options, &mut Portion::new(observer, from, 1.0))?;
    let Some([of_target, of_reference]) = found.samples else {
        let prediction_error = Some(found.estimate.residual);
        return Ok(Alignment { prediction_error, ..alignment(found.estimate, [None, None]) });
    };
    let (map, error) = target_map(&of_target, target.image, observer)?;
    let (depth, prediction_error) = ([Some(Cow::Owned(map)), None], Some([error; 2]));
    Ok(Alignment { prediction_error, missing: Some(of_reference), ..alignment(found.estimate, depth) })
}

/// The models with the depth maps of the views; a missing one is derived from the other.
fn fit_to_maps<'a>(
    matches: &[Match],
    views: [View<'a>; 2],
    without_depth: WithoutDepth,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let mut maps = views.map(|view| view.depth.map(Cow::Borrowed));
    let mut derivation = Portion::of_stage(observer, Stage::Estimate, 0.0, 0.3);
    if without_depth == WithoutDepth::TwoView
        && let [target, reference] = views.map(|view| view.frame())
        && let Some(derived) = derive_missing(matches, target, reference, options, &mut derivation)?
        && let Some(missing) = maps.iter_mut().find(|map| map.is_none())
    {
        *missing = Some(Cow::Owned(derived));
    }
    let frames = [0, 1].map(|side| Frame { depth: maps[side].as_deref(), ..views[side].frame() });
    let fitted = estimate(matches, frames[0], frames[1], options, &mut Portion::new(observer, 0.3, 0.6))?;
    let tracked = match &maps[1] {
        // Exact depth makes the photos match all over the overlap: that ties the cameras far better than features do.
        Some(map) if fitted.comparison.is_some_and(|comparison| comparison.exact) => {
            fit_to_tracked(matches, views, frames, map, &fitted, options, observer)?
        }
        _ => None,
    };
    Ok(alignment(tracked.unwrap_or(fitted), maps))
}

/// The calibrated models of `fitted` again, fitted to points tracked over the whole overlap as well; `None` when there are
/// none.
fn fit_to_tracked(
    matches: &[Match],
    [target, reference]: [View<'_>; 2],
    frames: [Frame<'_>; 2],
    reference_depth: &InverseDepth,
    fitted: &Estimate,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<Option<Estimate>> {
    if fitted.kind != ModelKind::Calibrated {
        return Ok(None);
    }
    let mut all = matches.to_vec();
    let mut tracking = Portion::new(observer, 0.6, 0.8);
    track(target.image, reference.image, reference_depth, &fitted.reverse, &mut all, &mut tracking)?;
    if all.len() == matches.len() {
        return Ok(None);
    }
    let refit = estimate(&all, frames[0], frames[1], options, &mut Portion::new(observer, 0.8, 1.0));
    Ok(if_possible(refit)?.map(|mut found| {
        let tracked = found.inliers.split_off(matches.len());
        found.tracked = tracked.into_iter().filter(|inlier| *inlier).count();
        // Tracked points say nothing about how good the matches are.
        Estimate { usable: fitted.usable, warnings: fitted.warnings.clone(), ..found }
    }))
}

/// An alignment before its depth is refined.
fn alignment(geometry: Estimate, depth: [Option<Cow<'_, InverseDepth>>; 2]) -> Alignment<'_> {
    let depth = if geometry.kind == ModelKind::Homography { [None, None] } else { depth };
    Alignment { matches: None, geometry, depth, missing: None, reliable: None, prediction_error: None, smooth: false }
}

impl Alignment<'_> {
    /// Makes the reference's map if it is missing: to match once more, the target's is enough.
    pub(super) fn complete_maps(&mut self, reference: View<'_>, observer: &mut dyn Observer) -> Result<()> {
        if let Some(samples) = self.missing.take() {
            let (map, error) = reference_map(&samples, reference.image, observer)?;
            self.depth[1] = Some(Cow::Owned(map));
            self.prediction_error = self.prediction_error.map(|[forward, _]| [forward, error]);
        }
        Ok(())
    }

    /// The share of the `target` that is behind the reference's camera, by the plane that most matches are near to. What depth was
    /// measured for may be there indeed, and of a masked photo it says little.
    fn share_behind(&self, target: ImageView<'_>) -> f64 {
        if matches!(self.geometry.kind, ModelKind::Depth | ModelKind::Calibrated) || target.is_masked() {
            return 0.0;
        }
        let h = &self.geometry.forward.h;
        let behind = |[x, y]: [f64; 2]| h[(2, 0)] * x + h[(2, 1)] * y + h[(2, 2)] <= 0.0;
        share_of_points(target.size(), behind)
    }

    /// Whether both depth maps explain the inliers' parallax. The inliers are those of the forward model; where the
    /// reverse model misses many of them, the reference's map contradicts it.
    fn maps_fit(&self, matches: &[Match]) -> bool {
        if self.geometry.kind == ModelKind::Homography {
            return false;
        }
        let tolerance = REVERSE_TOLERANCE * self.geometry.threshold;
        let inliers: Vec<_> = self.geometry.inliers_of(matches).collect();
        let explained = inliers.iter().filter(|m| self.transfer_error(1, m).is_some_and(|error| error < tolerance));
        explained.count() as f64 >= CONSISTENT_SHARE * inliers.len() as f64
    }
}

impl<'a> View<'a> {
    fn frame(&self) -> Frame<'a> {
        Frame { size: self.image.size(), depth: self.depth }
    }
}
