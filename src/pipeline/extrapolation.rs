//! How to show what only the target shows. Nothing measures depth there, so what counts is that it looks natural: the same
//! surface is extrapolated as it is, or becomes a plane, or a homography takes the place of both photos' depth: whichever is predicted to look best.

use super::models::{fit_homography, if_possible};
use super::options::Options;
use super::prediction::Prediction;
use crate::depth::{
    CompletionOptions, Extrapolation, KnownDepth, MeasuredDepth, OtherView, Refined, Surface, SurfaceShape,
    complete_reference_depth,
};
use crate::geometry::{DepthSample, Estimate, Match, Model};
use crate::observer::{Observer, Portion};
use crate::{ImageView, InverseDepth, Result};

/// The surfaces to choose from. A soft one aligns more, a stiff one distorts less; which looks better depends on the scene.
const SHAPES: [SurfaceShape; 4] = [
    SurfaceShape { stiffness: 1.0, extrapolation: Extrapolation::Surface },
    SurfaceShape { stiffness: 1.0, extrapolation: Extrapolation::Plane },
    SurfaceShape { stiffness: 16.0, extrapolation: Extrapolation::Surface },
    SurfaceShape { stiffness: 16.0, extrapolation: Extrapolation::Plane },
];
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
    let models = [&geometry.forward, &geometry.reverse];
    let [target_matches, reference_matches] = [0, 1].map(|side| triangulated(geometry, matches, side));
    let [reliable_target, reliable_reference] = &refined.reliable;
    let other = OtherView { model: models[0], size: reference.size() };
    let first = &mut Portion::new(observer, 0.0, 0.4);
    let mut known =
        KnownDepth::of(&refined.target, Some(target), other, Some(reliable_target), &target_matches, first)?;
    let prediction = Prediction::new(photos)?;
    let Some(best) = best_surface(&mut known, &prediction, models[0])? else {
        return Ok(Completed::Surfaces([refined.target, refined.reference], Extrapolation::Surface));
    };
    let sizes = photos.map(|photo| photo.size());
    let fitting = &mut Portion::new(observer, 0.4, 0.5);
    if let Some(flat) = if_possible(fit_homography(matches, sizes, &options.estimate, fitting))?
        && prediction.flaws(&flat.forward, &|_| 0.0)? + HOMOGRAPHY_LEAD < best.flaws
    {
        return Ok(Completed::Homography(Box::new(flat)));
    }
    let own = best.surface.map(target.size())?;
    // Not needed any more, and as large as a few maps when the photos are small.
    drop((known, prediction, refined.target));
    let options = CompletionOptions { keep_reliable: false, shape: best.shape };
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

/// The surface through what is known of the target's depth that would look best; `None` when hardly anything is known.
fn best_surface(known: &mut KnownDepth<'_>, prediction: &Prediction, model: &Model) -> Result<Option<Candidate>> {
    let mut best: Option<Candidate> = None;
    for shape in SHAPES {
        let Some(surface) = known.surface(shape)? else { continue };
        let flaws = prediction.flaws(model, &|point| surface.at(point))?;
        if best.as_ref().is_none_or(|best| flaws < best.flaws) {
            best = Some(Candidate { surface, shape, flaws });
        }
    }
    Ok(best)
}
