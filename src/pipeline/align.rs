//! The first half of the pipeline: features → geometry → depth.

use std::borrow::Cow;

use super::extrapolation::{Completed, better_rotation, complete, triangulated};
use super::features::{DetectWorkers, MatchedFeatures, detect_both, match_along_epipolar_lines, match_pair};
use super::halved::Halved;
use super::memory::{Job, Memory};
use super::models::{fit_models, if_possible};
use super::options::{Options, WithoutDepth};
use super::timer::StageTimer;
use super::visible::VisiblePair;
use crate::depth::{Extrapolation, MeasuredDepth, OtherView, Prior, RefineOptions, correct_outside, refine_prior};
use crate::features::Features;
use crate::geometry::{DepthSample, Estimate, Match, Model, ModelKind};
use crate::observer::{Observer, Portion};
use crate::rect::diagonal;
use crate::report::Warning;
use crate::statistics::nth;
use crate::workers::without_waiting;
use crate::{ImageView, InverseDepth, Mask, Result, Stage, View};

/// How much of the refinement of two photos alone is stereo matching, about; the rest is completion.
const REFINEMENT: f32 = 0.6;

/// Both models and both inverse-depth maps: what rendering needs besides the photos.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment<'a> {
    /// The matches that were found; `None` when they were given.
    pub matches: Option<Vec<Match>>,
    /// Both models, and how they were found.
    pub geometry: Estimate,
    /// Of target and reference; `None` with a homography, in which depth plays no part.
    pub depth: [Option<Cow<'a, InverseDepth>>; 2],
    /// What the reference's map is to be made of, while it is not there.
    pub(super) missing: Option<Vec<DepthSample>>,
    /// Reference pixels whose depth the refinement found reliable; `None` without refinement, and with two photos alone, whose
    /// depth is a smooth surface.
    pub reliable: Option<Mask>,
    /// With depth from the matches themselves, how far it misses matches left out of it: see
    /// [`TwoView`](crate::depth::TwoView).
    pub(super) prediction_error: Option<[f64; 2]>,
    /// Whether the maps are smooth surfaces, which say nothing about what hides what.
    pub(super) smooth: bool,
}

/// Finds the models and the inverse-depth maps that go with them; without `matches`, features of both photos are
/// detected and matched.
///
/// A depth map that does not fit the matches is ignored, with a warning, unless
/// [`WithoutDepth::Homography`](super::WithoutDepth::Homography) is asked for.
///
/// # Errors
/// `invalid-argument` for a photo that is all masked,
/// `too-large` when more than [`WarpOptions::max_bytes`](crate::warp::WarpOptions::max_bytes) would be needed, and those of
/// the stages: see [`detect`](crate::features::detect), [`match_features`](crate::features::match_features),
/// [`estimate`](crate::geometry::estimate), [`two_view`](crate::depth::two_view) and [`refine`](crate::depth::refine).
pub fn align<'a>(
    matches: Option<&[Match]>,
    target: View<'a>,
    reference: View<'a>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    without_waiting(align_with_workers(matches, [target, reference], options, &(), observer))
}

/// As [`align`], with tasks left to workers.
pub(crate) async fn align_with_workers<'a>(
    matches: Option<&[Match]>,
    views: [View<'a>; 2],
    options: &Options,
    workers: &DetectWorkers,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    Memory::of(Job::of(views, matches.is_some()), options).check((0, 0))?;
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePair::of(matches, views)?;
    if visible.is_everything() {
        return align_timed(matches, views, options, workers, observer, &mut timer).await;
    }
    let (matches, views) = (visible.matches(matches), visible.views(views));
    Ok(align_timed(matches, views, options, workers, observer, &mut timer).await?.into_owned())
}

pub(super) async fn align_timed<'a>(
    given: Option<&[Match]>,
    views: [View<'a>; 2],
    options: &Options,
    workers: &DetectWorkers,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Alignment<'a>> {
    let features = match given {
        None => {
            let photos = views.map(|view| view.image);
            let found = detect_both(photos, &options.features.detect, workers, observer).await?;
            timer.end(Stage::Detect, observer);
            Some(found)
        }
        Some(_) => None,
    };
    let Some(halved) = Halved::of(views, options)? else {
        return align_detected(given, features, views, options, observer, timer);
    };
    let matches = given.map(|matches| halved.matches(matches)).transpose()?;
    let features = features.map(|features| halved.features(features));
    let options = halved.options(options);
    let found = align_detected(matches.as_deref(), features, halved.views(), &options, observer, timer)?;
    halved.enlarged(found)
}

/// Models and maps from matches, or from features where there are none.
fn align_detected<'a>(
    given: Option<&[Match]>,
    features: Option<[Features; 2]>,
    views: [View<'a>; 2],
    options: &Options,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Alignment<'a>> {
    let found = match features {
        Some(features) => {
            let found = match_pair(features, &options.features.matching, observer)?;
            timer.end(Stage::Match, observer);
            Some(found)
        }
        None => None,
    };
    let mut alignment = align_matched(given, found.as_ref(), views, options, observer, timer)?;
    if let Some(refine) = &options.refine {
        let homography = match alignment.geometry.kind {
            ModelKind::TwoView => align_without_parallax(given, found.as_ref(), views, options, observer)?,
            _ => None,
        };
        // Nothing is matched any more.
        drop(found);
        alignment.refine_depth(given, homography, views, refine, options, observer)?;
        timer.end(Stage::Refine, observer);
    }
    Ok(alignment)
}

/// Models and maps from the matches that were given, or `found`.
fn align_matched<'a>(
    given: Option<&[Match]>,
    found: Option<&MatchedFeatures>,
    views: [View<'a>; 2],
    options: &Options,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Alignment<'a>> {
    let matches = given.or(found.map(|found| found.matches.as_slice())).unwrap_or_default();
    let first = fit_models(matches, views, options, observer)?;
    timer.end(first.stage(), observer);
    let second = match found {
        Some(found) if options.features.guided => align_guided(found, &first, views, options, observer, timer)?,
        _ => None,
    };
    let mut best = second.unwrap_or(Alignment { matches: found.map(|found| found.matches.clone()), ..first });
    best.complete_maps(views[1], observer)?;
    timer.end(best.stage(), observer);
    Ok(best)
}

/// The homography that would be found if none but that were looked for: what was matched along wrong epipolar lines may hide it. A part of the refinement.
fn align_without_parallax<'a>(
    given: Option<&[Match]>,
    found: Option<&MatchedFeatures>,
    views: [View<'a>; 2],
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Option<Alignment<'a>>> {
    let views = views.map(|view| View { depth: None, ..view });
    let options = &Options { without_depth: WithoutDepth::Homography, ..options.clone() };
    let observer = &mut Portion::of_stage(observer, Stage::Refine, 0.0, 0.0);
    let mut timer = StageTimer::start(observer);
    if_possible(align_matched(given, found, views, options, observer, &mut timer))
}

/// Matches again along the epipolar lines of `first`, and fits again; `None` unless that explains these matches better.
fn align_guided<'a>(
    found: &MatchedFeatures,
    first: &Alignment<'a>,
    views: [View<'a>; 2],
    options: &Options,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Option<Alignment<'a>>> {
    let matches = match_along_epipolar_lines(found, first, &options.features.matching, observer)?;
    timer.end(Stage::Match, observer);
    let second = if_possible(fit_models(&matches, views, options, observer))?;
    timer.end(second.as_ref().unwrap_or(first).stage(), observer);
    let threshold = first.geometry.threshold;
    let better =
        second.filter(|second| second.robust_cost(&matches, threshold) < first.robust_cost(&matches, threshold));
    Ok(better.map(|second| Alignment { matches: Some(matches), ..second }))
}

/// Four times the prediction error of a photo's depth as a share of its diagonal, but at least half of `most`, and no more than that.
pub(super) fn void_distance(error: f64, photo: (usize, usize), most: f64) -> f64 {
    (4.0 * error / diagonal(photo)).max(0.5 * most).min(most)
}

impl Alignment<'_> {
    /// With maps of its own.
    fn into_owned(self) -> Alignment<'static> {
        let Self { matches, geometry, depth, missing, reliable, prediction_error, smooth } = self;
        let depth = depth.map(|map| map.map(|map| Cow::Owned(map.into_owned())));
        Alignment { matches, geometry, depth, missing, reliable, prediction_error, smooth }
    }

    /// The views with the depth maps of this alignment.
    pub fn views<'b>(&'b self, target: View<'b>, reference: View<'b>) -> [View<'b>; 2] {
        let view = |view: View<'b>, side: usize| View { depth: self.depth[side].as_deref(), ..view };
        [view(target, 0), view(reference, 1)]
    }

    /// The void distance to warp this alignment with, as a share of the diagonal of `target`. Depth from the photos alone
    /// is soon wrong where no match supports it: then it is four times its prediction error, but at least half of `most`.
    /// With two smooth surfaces it is 1: where they contradict each other is no void.
    #[must_use]
    pub fn void_distance(&self, target: ImageView<'_>, most: f64) -> f64 {
        if self.smooth {
            return 1.0;
        }
        self.prediction_error.map_or(most, |[error, _]| void_distance(error, target.size(), most))
    }

    /// The stretch limit to warp this alignment with, of which `most` is wanted: none on a cylinder or sphere (`on_curved_surface`), unless maps
    /// say what hides what. There a wall beside the reference's camera is stretched as it should be, and not torn apart.
    #[must_use]
    pub fn stretch_limit(&self, most: f64, on_curved_surface: bool) -> f64 {
        if on_curved_surface && (self.smooth || self.depth[0].is_none()) { f64::MAX } else { most }
    }

    /// The name of the stage that fitted the models.
    pub(super) fn stage(&self) -> Stage {
        if self.geometry.kind == ModelKind::TwoView { Stage::Depth } else { Stage::Estimate }
    }

    /// Refines both depth maps along the epipolar lines; a homography has none.
    fn refine_depth(
        &mut self,
        given: Option<&[Match]>,
        homography: Option<Alignment<'_>>,
        [target, reference]: [View<'_>; 2],
        refine: &RefineOptions,
        options: &Options,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let Estimate { forward, reverse, kind, .. } = self.geometry;
        let matches = given.or(self.matches.as_deref()).unwrap_or_default();
        if kind == ModelKind::Homography {
            let photos_alone = target.depth.is_none() && reference.depth.is_none();
            if photos_alone && options.without_depth == WithoutDepth::TwoView {
                let photos = [target.image, reference.image];
                if let Some(rotated) = better_rotation(&self.geometry, matches, photos, options.estimate.focal)? {
                    self.replace_by_homography(rotated, Warning::ParallaxUnobservable);
                }
            }
            return Ok(());
        }
        let error = self.prediction_error.unwrap_or_else(|| self.inlier_error(matches));
        let prior = Prior { error, weak: kind == ModelKind::TwoView, reliable_only: false };
        let photos = [target.image, reference.image];
        let [target, reference] = self.views(target, reference);
        // Maps of a network, say: outside of the reference nothing corrects their errors.
        let inexact = self.geometry.comparison.is_some_and(|comparison| !comparison.exact);
        let share = if prior.weak || inexact { REFINEMENT } else { 1.0 };
        let refining = &mut Portion::new(observer, 0.0, share);
        let mut refined = refine_prior(target, reference, &forward, &reverse, prior, refine, refining)?;
        let completing = &mut Portion::of_stage(observer, Stage::Refine, share, 1.0);
        if prior.weak {
            // The priors make room: nothing reads them any more.
            self.depth = [None, None];
            let flat =
                homography.as_ref().map(|flat| (&flat.geometry, given.or(flat.matches.as_deref()).unwrap_or_default()));
            match complete(&self.geometry, matches, flat, photos, refined, options, completing)? {
                Completed::Surface(maps, extrapolation) => {
                    self.depth = maps.map(|map| Some(Cow::Owned(map)));
                    self.smooth = true;
                    if matches!(extrapolation, Extrapolation::Plane | Extrapolation::FrontoParallel(_)) {
                        self.geometry.warnings.push(Warning::OutsideExtrapolated);
                    }
                }
                Completed::Homography(flat) => {
                    self.replace_by_homography(*flat, Warning::ParallaxIgnored);
                    if let Some(Alignment { matches, .. }) = homography {
                        self.matches = matches;
                    }
                }
            }
            return Ok(());
        }
        if let Some(prior) = target.depth.filter(|_| inexact) {
            let matches = &triangulated(&self.geometry, matches);
            let measured = MeasuredDepth { map: &refined.target, reliable: &refined.reliable[0], matches };
            let reference = OtherView::new(&forward, photos[1].size());
            if let Some(corrected) = correct_outside(&measured, prior, photos[0], reference, completing)? {
                refined.target = corrected;
            }
        }
        self.depth = [refined.target, refined.reference].map(|map| Some(Cow::Owned(map)));
        let [_, reliable] = refined.reliable;
        self.reliable = Some(reliable);
        Ok(())
    }

    /// Goes on without depth, for this reason.
    fn replace_by_homography(&mut self, mut flat: Estimate, reason: Warning) {
        flat.warnings.retain(|warning| !matches!(warning, Warning::NoDepth));
        flat.warnings.insert(0, reason);
        let ignored =
            |warning: &&Warning| matches!(warning, Warning::DepthInconsistent | Warning::DepthUnusable { .. });
        flat.warnings.extend(self.geometry.warnings.iter().filter(ignored).cloned());
        self.geometry = flat;
        self.depth = [None, None];
        self.prediction_error = None;
    }

    /// Σ min(r²/t², 1) over the matches, t the threshold in pixels. r is the forward transfer error; with depth from the
    /// matches themselves, the distance from the epipolar line.
    fn robust_cost(&self, matches: &[Match], threshold: f64) -> f64 {
        let Estimate { forward, kind, .. } = &self.geometry;
        let cost = |m: &Match| {
            let error = if *kind == ModelKind::TwoView {
                forward.epipolar_distance(m.target, m.reference)
            } else {
                self.transfer_error(0, m)
            };
            error.map_or(1.0, |error| (error * error / (threshold * threshold)).min(1.0))
        };
        matches.iter().map(cost).sum()
    }

    /// [`Model::transfer_error`] of a match by model and depth of one photo, `side` (0 the target, 1 the reference); `None` also where
    /// depth is unknown.
    pub(super) fn transfer_error(&self, side: usize, m: &Match) -> Option<f64> {
        let ends = [m.target, m.reference];
        let model: &Model = [&self.geometry.forward, &self.geometry.reverse][side];
        let [x, y] = ends[side];
        let d = self.depth[side].as_ref().map_or(0.0, |map| map.sample(x, y));
        model.transfer_error([x, y], d, ends[1 - side])
    }

    /// The 90th percentile of the inliers' transfer errors in pixels, forward and reverse.
    pub(super) fn inlier_error(&self, matches: &[Match]) -> [f64; 2] {
        [0, 1].map(|side| {
            let inliers = self.geometry.inliers_of(matches);
            let errors = inliers.filter_map(|m| self.transfer_error(side, m)).filter(|error| !error.is_nan());
            let errors: Vec<f64> = errors.collect();
            let rank = errors.len() * 9 / 10;
            nth(errors, rank).unwrap_or(0.0)
        })
    }
}
