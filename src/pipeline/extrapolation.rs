//! How to show what only the target shows. Nothing measures depth there, so what counts is that it looks natural: the same
//! surface goes on, bends back to a plane, or, when neither will do, a homography takes the place of both photos' depth.

use super::models::{fit_homography, if_possible};
use super::options::Options;
use crate::depth::{CompletionOptions, Extrapolation, KnownDepth, OtherView, Refined, complete_reference_depth};
use crate::geometry::{Estimate, Match, Model, anisotropy};
use crate::metrics::bending;
use crate::observer::{Observer, Portion};
use crate::{ImageView, InverseDepth, Result};

/// A surface that bends the outside by more than this, in per cent of the diagonal, had better be a plane there. Tuned on 25
/// real pairs: 0.9 and less looks right, 1.6 and more does not.
const MOST_BENDING: f64 = 1.3;
/// What a per cent of bending counts, next to a unit of anisotropy.
const BENDING_WEIGHT: f64 = 0.15;
/// By how much less a homography has to distort, as it misses whatever is nearer or farther than its plane. Tuned on the
/// evaluation cases: depth looks as good or better up to 0.5, worse at 0.9.
const HOMOGRAPHY_LEAD: f64 = 0.7;

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
    let [forward, reverse] = [&geometry.forward, &geometry.reverse];
    let sizes = [target, reference].map(|photo| photo.size());
    let [reliable_target, reliable_reference] = &refined.reliable;
    let other = OtherView { model: forward, size: sizes[1] };
    let first = &mut Portion::new(observer, 0.0, 0.4);
    let mut known = KnownDepth::of(&refined.target, Some(target), other, Some(reliable_target), first)?;
    let found = best_surface(&mut known, other)?;
    let (own, extrapolation) = found.unwrap_or((refined.target, Extrapolation::Surface));
    let distorted = distortion(forward, Some(&own), sizes);
    if distorted > HOMOGRAPHY_LEAD
        && let Some(flat) =
            if_possible(fit_homography(matches, sizes, &options.estimate, &mut Portion::new(observer, 0.4, 0.5)))?
        && distortion(&flat.forward, None, sizes) + HOMOGRAPHY_LEAD < distorted
    {
        return Ok(Completed::Homography(Box::new(flat)));
    }
    let options = CompletionOptions { keep_reliable: false, extrapolation };
    let (models, second) = ([forward, reverse], &mut Portion::new(observer, 0.5, 1.0));
    let others =
        complete_reference_depth(&refined.reference, reference, &own, models, reliable_reference, &options, second)?;
    Ok(Completed::Surfaces([own, others], extrapolation))
}

/// How far what a model shows outside the reference is from keeping shapes as they are; 0 for a similarity. `sizes` are those of
/// target and reference.
fn distortion(model: &Model, depth: Option<&InverseDepth>, [target, reference]: [(usize, usize); 2]) -> f64 {
    let at = |x: f64, y: f64| depth.map_or(0.0, |depth| depth.sample(x, y));
    let leaning = anisotropy(model, target, &at, Some(reference)).unwrap_or(0.0);
    leaning + BENDING_WEIGHT * bending(target, model, depth, reference).unwrap_or(0.0)
}

/// A surface through what is known of the target's depth, and how it was extrapolated: as a plane where going on would bend too
/// much. `None` when hardly anything is known.
fn best_surface(known: &mut KnownDepth<'_>, reference: OtherView<'_>) -> Result<Option<(InverseDepth, Extrapolation)>> {
    let mut completed = |extrapolation| -> Result<Option<(f64, InverseDepth)>> {
        let surface = known.completed(&CompletionOptions { keep_reliable: false, extrapolation })?;
        Ok(surface.map(|surface| {
            let size = surface.size();
            let bent = bending(size, reference.model, Some(&surface), reference.size).unwrap_or(0.0);
            (bent, surface)
        }))
    };
    let Some((bent, surface)) = completed(Extrapolation::Surface)? else { return Ok(None) };
    if bent > MOST_BENDING
        && let Some((less, plane)) = completed(Extrapolation::Plane)?
        && less < bent
    {
        return Ok(Some((plane, Extrapolation::Plane)));
    }
    Ok(Some((surface, Extrapolation::Surface)))
}
