//! Models, and the inverse depth that goes with them, from whatever depth there is.

use std::borrow::Cow;

use super::{Options, WithoutDepth};
use crate::depth::{Prior, RefineOptions, continue_outside, derive_missing, refine_prior, two_view};
use crate::features::track;
use crate::geometry::{Estimate, Frame, Match, Model, ModelKind, estimate};
use crate::observer::Observer;
use crate::statistics::nth;
use crate::{ImageView, InverseDepth, Mask, Result, Stage, View};

/// Both models and both inverse-depth maps.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment<'a> {
    /// The matches that were found; `None` when they were given.
    pub matches: Option<Vec<Match>>,
    /// Both models, and how they were found.
    pub geometry: Estimate,
    /// Of target and reference; `None` where there is none, which only a homography can do without.
    pub depth: [Option<Cow<'a, InverseDepth>>; 2],
    /// Reference pixels whose depth the refinement is sure of.
    pub trusted: Option<Mask>,
    /// How far depth from the matches themselves misses those that took no part in it: see [`TwoView::spread`].
    pub(super) spread: Option<[f64; 2]>,
}

/// Fits the models to the matches, with the depth maps of the views or, without any, with depth from the matches.
pub(super) fn fit<'a>(
    matches: &[Match],
    target: View<'a>,
    reference: View<'a>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let given = target.depth.is_some() || reference.depth.is_some();
    if !given && options.without_depth == WithoutDepth::TwoView {
        let found = two_view(matches, target.image, reference.image, &options.estimate, observer)?;
        let depth = [found.target, found.reference].map(|map| Some(Cow::Owned(map)));
        return Ok(Alignment {
            matches: None,
            geometry: found.geometry,
            depth,
            trusted: None,
            spread: Some(found.spread),
        });
    }
    let mut depth = [target.depth, reference.depth].map(|map| map.map(Cow::Borrowed));
    if options.without_depth == WithoutDepth::TwoView
        && let Some(derived) = derive_missing(matches, target.frame(), reference.frame(), &options.estimate, observer)?
        && let Some(missing) = depth.iter_mut().find(|map| map.is_none())
    {
        *missing = Some(Cow::Owned(derived));
    }
    let frame = |view: View<'a>, side: usize| Frame { depth: depth[side].as_deref(), ..view.frame() };
    let frames = [frame(target, 0), frame(reference, 1)];
    let mut geometry = estimate(matches, frames[0], frames[1], &options.estimate, observer)?;
    // Exact depth makes the photos match all over the overlap: that ties the cameras far better than features do.
    if geometry.kind == ModelKind::Calibrated
        && geometry.comparison.is_some_and(|comparison| comparison.exact)
        && let Some(map) = &depth[1]
    {
        let mut all = matches.to_vec();
        track(target.image, reference.image, map, &geometry.reverse, &mut all, observer)?;
        if all.len() > matches.len() {
            let mut again = estimate(&all, frames[0], frames[1], &options.estimate, observer)?;
            again.followed = all.len() - matches.len();
            again.inliers.truncate(matches.len());
            // What there is to say of the matches does not change by what is followed.
            geometry = Estimate { usable: geometry.usable, warnings: geometry.warnings, ..again };
        }
    }
    Ok(Alignment { matches: None, geometry, depth, trusted: None, spread: None })
}

impl Alignment<'_> {
    /// The views with the depth maps of this alignment.
    pub fn views<'b>(&'b self, target: View<'b>, reference: View<'b>) -> [View<'b>; 2] {
        let view = |view: View<'b>, side: usize| View { depth: self.depth[side].as_deref(), ..view };
        [view(target, 0), view(reference, 1)]
    }

    /// The void distance to warp this alignment with, as a share of the diagonal of `target`. Depth from the photos alone
    /// soon is wrong where they do not tell of it: it is four times what the matches miss, from half of `most` to all of it.
    #[must_use]
    pub fn void_distance(&self, target: ImageView<'_>, most: f64) -> f64 {
        let [w, h] = [target.width(), target.height()].map(|side| side as f64);
        self.spread.map_or(most, |[spread, _]| (4.0 * spread / (w * w + h * h).sqrt()).max(0.5 * most).min(most))
    }

    /// What the stage is called that made this alignment.
    pub(super) fn stage(&self) -> Stage {
        if self.geometry.kind == ModelKind::TwoView { Stage::Depth } else { Stage::Estimate }
    }

    /// Refines both depth maps along the epipolar lines; a homography has nothing to refine.
    pub(super) fn refine(
        &mut self,
        given: Option<&[Match]>,
        target: View<'_>,
        reference: View<'_>,
        options: &RefineOptions,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let Estimate { forward, reverse, kind, .. } = self.geometry;
        if kind == ModelKind::Homography {
            return Ok(());
        }
        let spread = self.spread.unwrap_or_else(|| self.spread(given.or(self.matches.as_deref()).unwrap_or_default()));
        let prior = Prior { error: spread, weak: kind == ModelKind::TwoView };
        let [target, reference] = self.views(target, reference);
        let refined = refine_prior(target, reference, &forward, &reverse, prior, options, observer)?;
        let sizes = [target, reference].map(|view| (view.image.width(), view.image.height()));
        let [trusted_target, trusted_reference] = refined.reliable;
        let mut maps = [refined.target, refined.reference];
        if kind == ModelKind::TwoView {
            // The photos say nothing about what only one of them shows.
            maps[0] = continue_outside(&maps[0], &forward, sizes[1], Some(&trusted_target), observer)?;
            maps[1] = continue_outside(&maps[1], &reverse, sizes[0], Some(&trusted_reference), observer)?;
        }
        self.depth = maps.map(|map| Some(Cow::Owned(map)));
        self.trusted = Some(trusted_reference);
        Ok(())
    }

    /// What the matches cost: Σ min(r²/t², 1) with the threshold t in pixels. r is the distance from where model and depth
    /// put the point; with depth from the matches themselves, from its epipolar line.
    pub(super) fn cost(&self, matches: &[Match], threshold: f64) -> f64 {
        let Estimate { forward, kind, .. } = &self.geometry;
        let share = |m: &Match| {
            let ([x, y], [u, v]) = (m.target, m.reference);
            let d = self.depth[0].as_ref().map_or(0.0, |map| map.sample(x, y));
            let squared = if *kind == ModelKind::TwoView {
                forward.epipolar_distance(m.target, m.reference).map(|distance| distance * distance)
            } else {
                forward.project(x, y, d).map(|[a, b]| (a - u) * (a - u) + (b - v) * (b - v))
            };
            squared.map_or(1.0, |squared| (squared / (threshold * threshold)).min(1.0))
        };
        matches.iter().map(share).sum()
    }

    /// How far the models and maps miss the inliers: the 90th percentile of the errors in pixels, forward and reverse.
    pub(super) fn spread(&self, matches: &[Match]) -> [f64; 2] {
        let inliers = || matches.iter().zip(&self.geometry.inliers).filter(|(_, inlier)| **inlier).map(|(m, _)| m);
        let error = |model: &Model, side: usize, [x, y]: [f64; 2], [u, v]: [f64; 2]| {
            let d = self.depth[side].as_ref().map_or(0.0, |map| map.sample(x, y));
            let [a, b] = model.project(x, y, d)?;
            Some(((a - u) * (a - u) + (b - v) * (b - v)).sqrt()).filter(|error| !error.is_nan())
        };
        let (forward, reverse) = (&self.geometry.forward, &self.geometry.reverse);
        let ninetieth = |errors: Vec<f64>| {
            let rank = errors.len() * 9 / 10;
            nth(errors, rank).unwrap_or(0.0)
        };
        [
            ninetieth(inliers().filter_map(|m| error(forward, 0, m.target, m.reference)).collect()),
            ninetieth(inliers().filter_map(|m| error(reverse, 1, m.reference, m.target)).collect()),
        ]
    }
}
