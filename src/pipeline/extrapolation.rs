//! How to show what only the target shows. Nothing measures depth there, so what counts most is that it looks natural: the same
//! surface is extrapolated in several ways, or a homography takes the place of both photos' depth: whichever is predicted to look best and
//! puts things about where they are expected.

use super::displacement::Expected;
use super::models::{fit_homography, if_possible};
use super::options::Options;
use super::prediction::Prediction;
use crate::depth::{
    CompletionOptions, Extrapolation, KnownDepth, MeasuredDepth, OtherView, Refined, Surface, SurfaceShape,
    complete_reference_depth,
};
use crate::geometry::{DepthSample, Estimate, Match, Model, plane_at_infinity};
use crate::observer::{Observer, Portion};
use crate::statistics::median;
use crate::{ImageView, InverseDepth, Result};

/// How stiff the surfaces to choose from are. A soft one aligns more, a stiff one distorts less; which looks better depends on the scene.
const STIFFNESS: [f64; 2] = [1.0, 16.0];
/// The stiffness of the surface that is expected outside: a soft one comes nearest to the truth. With 1, what is hidden of 13 pairs is displaced by
/// 10 % more.
const EXPECTED: f64 = 0.25;
/// What a displacement by the reference's diagonal counts, next to a unit of anisotropy. Chosen by eye on 13 real pairs, with their matches and our own: at
/// 3 trees and a cone lean in one of them, from 5 on in three; at 0 two of them are farther from the truth and look no better.
const DISPLACEMENT_WEIGHT: f64 = 2.0;
/// By how much better a homography has to look, as it misses whatever is nearer or farther than its plane.
const HOMOGRAPHY_LEAD: f64 = 0.1;

/// What takes the place of refined depth when there are two photos and nothing else.
pub(super) enum Completed {
    /// Surfaces of the target and of the reference, and how they were extrapolated.
    Surfaces([InverseDepth; 2], Extrapolation),
    /// They would look worse than this.
    Homography(Box<Estimate>),
}

/// Two photos say nothing about the depth of what only one of them shows, and pixel by pixel too little for a picture without
/// torn edges: smooth surfaces take the place of both `refined` maps, or a homography of the `matches` where that looks better.
pub(super) fn complete(
    geometry: &Estimate,
    matches: &[Match],
    [target, reference]: [ImageView<'_>; 2],
    refined: Refined,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Completed> {
    let photos = [target, reference];
    let sizes = photos.map(|photo| photo.size());
    let models = [&geometry.forward, &geometry.reverse];
    let [target_matches, reference_matches] = [0, 1].map(|side| triangulated(geometry, matches, side));
    let [reliable_target, reliable_reference] = &refined.reliable;
    let ends: Vec<_> = geometry.inliers_of(matches).map(|m| [m.target, m.reference]).collect();
    let infinity = plane_at_infinity(models[0], &ends, sizes, options.estimate.focal).map(|[a, b, _]| [a, b]);
    let other = OtherView { infinity, ..OtherView::new(models[0], sizes[1]) };
    let first = &mut Portion::new(observer, 0.0, 0.4);
    let mut known =
        KnownDepth::of(&refined.target, Some(target), other, Some(reliable_target), &target_matches, first)?;
    let judge = Judge::new(photos, &mut known, other)?;
    let Some(best) = best_surface(&mut known, &judge)? else {
        return Ok(Completed::Surfaces([refined.target, refined.reference], Extrapolation::Surface));
    };
    let fitting = &mut Portion::new(observer, 0.4, 0.5);
    if let Some(flat) = if_possible(fit_homography(matches, sizes, &options.estimate, fitting))?
        && judge.flaws(&flat.forward, &|_| 0.0)? + HOMOGRAPHY_LEAD < best.flaws
    {
        return Ok(Completed::Homography(Box::new(flat)));
    }
    let own = best.surface.map(target.size())?;
    // Not needed any more, and as large as a few maps when the photos are small.
    drop((known, judge, refined.target));
    // Nothing is shown of the reference's outside.
    let shape = SurfaceShape { extrapolation: Extrapolation::Surface, ..best.shape };
    let options = CompletionOptions { keep_reliable: false, shape };
    let measured = MeasuredDepth { map: &refined.reference, reliable: reliable_reference, matches: &reference_matches };
    let second = &mut Portion::new(observer, 0.5, 1.0);
    let others = complete_reference_depth(&measured, reference, &own, models, &options, second)?;
    Ok(Completed::Surfaces([own, others], best.shape.extrapolation))
}

/// Inliers among the matches with their depth in the target (side 0) or the reference (1).
pub(super) fn triangulated(geometry: &Estimate, matches: &[Match], side: usize) -> Vec<DepthSample> {
    let model = [&geometry.forward, &geometry.reverse][side];
    let sample = |m: &Match| {
        let ends = [m.target, m.reference];
        let depth = model.triangulate(ends[side], ends[1 - side])?;
        Some(DepthSample::new(model, ends[side], depth))
    };
    geometry.inliers_of(matches).filter_map(sample).collect()
}

/// A surface of the target, and how it would look.
struct Candidate {
    surface: Surface,
    shape: SurfaceShape,
    flaws: f64,
}

/// What alignments are judged by.
struct Judge<'a> {
    prediction: Prediction,
    model: &'a Model,
    /// Where things outside of the reference are expected, and their median inverse depth next to that of what is infinitely far: `None` where that is
    /// not known.
    outside: Option<(Expected, f64)>,
}

impl<'a> Judge<'a> {
    fn new(photos: [ImageView<'_>; 2], known: &mut KnownDepth<'_>, other: OtherView<'a>) -> Result<Self> {
        let shape = SurfaceShape { stiffness: EXPECTED, extrapolation: Extrapolation::Outward };
        let outside = match (other.infinity, known.surface(shape)?) {
            (Some([a, b]), Some(surface)) => {
                let expected = Expected::new(&surface, other.model, photos.map(|photo| photo.size()));
                let depths = expected.points().map(|[x, y]| surface.at([x, y]) - a * x - b * y);
                median(depths.collect()).map(|depth| (expected, depth))
            }
            _ => None,
        };
        Ok(Self { prediction: Prediction::new(photos)?, model: other.model, outside })
    }

    /// How unnatural the mosaic would look, and how far from the truth, with this model and the target's inverse depth.
    fn flaws(&self, model: &Model, depth: &dyn Fn([f64; 2]) -> f64) -> Result<f64> {
        let place = |point: [f64; 2]| model.project(point[0], point[1], depth(point));
        let off = self.outside.as_ref().map_or(0.0, |(expected, _)| expected.displacement(&place));
        Ok(self.prediction.flaws(model, depth)? + DISPLACEMENT_WEIGHT * off)
    }
}

/// The surface through what is known of the target's depth that would look best; `None` when hardly anything is known.
fn best_surface(known: &mut KnownDepth<'_>, judge: &Judge<'_>) -> Result<Option<Candidate>> {
    let mut ways = vec![Extrapolation::Surface, Extrapolation::Plane];
    if let Some((_, depth)) = judge.outside {
        ways.extend([Extrapolation::Outward, Extrapolation::FrontoParallel(depth)]);
    }
    let mut best: Option<Candidate> = None;
    for stiffness in STIFFNESS {
        for &extrapolation in &ways {
            let shape = SurfaceShape { stiffness, extrapolation };
            let Some(surface) = known.surface(shape)? else { continue };
            let flaws = judge.flaws(judge.model, &|point| surface.at(point))?;
            if best.as_ref().is_none_or(|best| flaws < best.flaws) {
                best = Some(Candidate { surface, shape, flaws });
            }
        }
    }
    Ok(best)
}
