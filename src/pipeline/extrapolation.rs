//! How to show what only the target shows. Nothing measures depth there, so what counts is that it looks natural: the same
//! surface is extrapolated in several ways, or a homography takes the place of both photos' depth: whichever is predicted to look best.

use super::misalignment::Border;
use super::options::Options;
use super::picture::{Picture, Placed};
use super::prediction::{Flaws, Prediction};
use super::projected::picture_of;
use crate::depth::{Extrapolation, KnownDepth, OtherView, Refined, Surface, SurfaceShape, derive_depth};
use crate::geometry::{DepthSample, Estimate, Match, plane_at_infinity, pure_rotation};
use crate::observer::{Observer, Portion};
use crate::rect::{diagonal, grid_points};
use crate::statistics::median;
use crate::{ImageView, InverseDepth, Result};

/// How stiff the surfaces to choose from are, and whether they are tight at the border of the overlap. A soft one aligns more, a stiff one distorts less;
/// which looks better depends on the scene.
const FITS: [(f64, bool); 3] = [(1.0, false), (16.0, false), (16.0, true)];
/// The surface that says how far away things are outside: a soft one comes nearest to the truth.
const EXPECTED: SurfaceShape =
    SurfaceShape { stiffness: 0.25, extrapolation: Extrapolation::Outward, tight_at_border: false };
/// The target is looked at at so many points a side for that.
const POINTS: usize = 32;
/// By how much better a homography has to look that misses what is nearer or farther than its plane by the second of these shares of the reference's
/// diagonal; below the first, which hardly shows, by nothing. Of 38 pairs, both ways round, three become homographies by that, and look better.
const HOMOGRAPHY_LEAD: f64 = 0.1;
const MISSED: [f64; 2] = [0.0012, 0.0024];
/// The same of a pure rotation, which misses all parallax: for turns so wide that nothing else is sane. None of 26 real pairs
/// changes by it.
const ROTATION_LEAD: f64 = 0.5;
/// A rotation is none that takes fewer than this share of a homography's inliers to within this share of the reference's diagonal, however natural it looks.
const LEAST_ROTATED: f64 = 0.5;
const NEAR: f64 = 0.01;

/// What takes the place of refined depth when there are two photos and nothing else.
pub(super) enum Completed {
    /// The surface as a map of the target and as one of the reference, and how it was extrapolated.
    Surface([InverseDepth; 2], Extrapolation),
    /// It would look worse than this.
    Homography(Box<Estimate>),
}

/// Two photos say nothing about the depth of what only one of them shows, and pixel by pixel too little for a picture without
/// torn edges: a smooth surface takes the place of both `refined` maps, or a `homography` (with the matches
/// it was fitted to) where that looks better.
pub(super) fn complete(
    geometry: &Estimate,
    matches: &[Match],
    homography: Option<(&Estimate, &[Match])>,
    [target, reference]: [ImageView<'_>; 2],
    refined: Refined,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Completed> {
    let photos = [target, reference];
    let sizes = photos.map(|photo| photo.size());
    let model = &geometry.forward;
    let samples = triangulated(geometry, matches);
    let ends: Vec<_> = geometry.inliers_of(matches).map(|m| [m.target, m.reference]).collect();
    let infinity = plane_at_infinity(model, &ends, sizes, options.estimate.focal).map(|[a, b, _]| [a, b]);
    let other = OtherView { infinity, ..OtherView::new(model, sizes[1]) };
    let first = &mut Portion::new(observer, 0.0, 0.5);
    let mut known = KnownDepth::of(&refined.target, Some(target), other, Some(&refined.reliable[0]), &samples, first)?;
    let border = Border::new(&known, &samples, sizes[0], other)?;
    let depth = median(samples.iter().map(|sample| sample.depth).collect()).unwrap_or(0.0);
    let placed = [Placed { size: sizes[0], model: geometry.forward, depth }, Placed::reference(sizes[1])];
    let picture = picture_of(placed, geometry, matches, options);
    let prediction = Prediction::new(photos, known.segments().to_vec(), border, picture)?;
    let Some(best) = best_surface(&mut known, &prediction, other, target.size())? else {
        return Ok(Completed::Surface([refined.target, refined.reference], Extrapolation::Surface));
    };
    drop(refined);
    let focal = options.estimate.focal;
    let rotated = match homography {
        Some((homography, matches)) => rotation_like(homography, matches, sizes, focal),
        None => pure_rotation(matches, sizes, focal),
    };
    let homography = homography.map(|(found, _)| found.clone());
    let candidates: Vec<(_, Lead)> = vec![(homography, homography_lead), (rotated, rotation_lead)];
    if let Some(found) = better_homography(&prediction, best.flaws, candidates)? {
        return Ok(Completed::Homography(Box::new(found)));
    }
    let own = best.surface.map(target.size())?;
    // Not needed any more, and as large as a few maps when the photos are small.
    drop((known, prediction));
    // One surface for both: what is shown is the target's.
    let deriving = &mut Portion::new(observer, 0.8, 1.0);
    let derived = derive_depth(&own, model, sizes[1], deriving)?;
    let others = derived.map_or_else(|| InverseDepth::constant(0.0, reference.width(), reference.height()), Ok)?;
    Ok(Completed::Surface([own, others], best.shape.extrapolation))
}

/// The pure rotation of the `matches` where that looks better than their `homography`: where the overlap is small, noise decides where a
/// homography takes what is far from all matches.
pub(super) fn better_rotation(
    homography: &Estimate,
    matches: &[Match],
    photos: [ImageView<'_>; 2],
    focal: Option<f64>,
) -> Result<Option<Estimate>> {
    let sizes = photos.map(|photo| photo.size());
    let Some(rotated) = rotation_like(homography, matches, sizes, focal) else { return Ok(None) };
    // A homography leaves straight lines straight, and there is no depth to miss at the border of the overlap.
    let prediction = Prediction::new(photos, Vec::new(), Border::default(), Picture::plane())?;
    let flaws = prediction.flaws(&homography.forward, &|_| 0.0)?.sum;
    better_homography(&prediction, flaws, vec![(Some(rotated), rotation_lead)])
}

/// The pure rotation of the `matches` if it explains what a `homography` does.
fn rotation_like(
    homography: &Estimate,
    matches: &[Match],
    sizes: [(usize, usize); 2],
    focal: Option<f64>,
) -> Option<Estimate> {
    let rotated = pure_rotation(matches, sizes, focal)?;
    let near = |m: &&Match| {
        let error = rotated.forward.transfer_error(m.target, 0.0, m.reference);
        error.is_some_and(|error| error <= NEAR * diagonal(sizes[1]))
    };
    let [all, explained] =
        [homography.inliers_of(matches).count(), homography.inliers_of(matches).filter(near).count()];
    (explained as f64 >= LEAST_ROTATED * all as f64).then_some(rotated)
}

/// By how much less flawed a candidate with these flaws has to be.
type Lead = fn(Flaws) -> f64;

fn homography_lead(flaws: Flaws) -> f64 {
    let [from, to] = MISSED;
    HOMOGRAPHY_LEAD * ((flaws.misalignment - from) / (to - from)).clamp(0.0, 1.0)
}

fn rotation_lead(_: Flaws) -> f64 {
    ROTATION_LEAD
}

/// The homography with the least flaws of the `candidates` that have, with the lead each needs, less than `flaws`.
fn better_homography(
    prediction: &Prediction,
    mut flaws: f64,
    candidates: Vec<(Option<Estimate>, Lead)>,
) -> Result<Option<Estimate>> {
    let mut better = None;
    for (candidate, lead) in candidates {
        if let Some(found) = candidate {
            let its = prediction.flaws(&found.forward, &|_| 0.0)?;
            if its.sum + lead(its) < flaws {
                (flaws, better) = (its.sum, Some(found));
            }
        }
    }
    Ok(better)
}

/// Inliers among the matches with their depth in the target.
pub(super) fn triangulated(geometry: &Estimate, matches: &[Match]) -> Vec<DepthSample> {
    let model = &geometry.forward;
    let sample = |m: &Match| Some(DepthSample::new(model, m.target, model.triangulate(m.target, m.reference)?));
    geometry.inliers_of(matches).filter_map(sample).collect()
}

/// A surface of the target, and how it would look.
struct Candidate {
    surface: Surface,
    shape: SurfaceShape,
    flaws: f64,
}

/// The surface through what is known of the target's depth that would look best; `None` when hardly anything is known.
fn best_surface(
    known: &mut KnownDepth<'_>,
    prediction: &Prediction,
    other: OtherView<'_>,
    size: (usize, usize),
) -> Result<Option<Candidate>> {
    let mut ways = vec![Extrapolation::Surface];
    if let Some(slopes) = other.infinity {
        ways.push(Extrapolation::Outward);
        if let Some(surface) = known.surface(EXPECTED)?
            && let Some(depth) = depth_outside(&surface, slopes, other, size)
        {
            ways.push(Extrapolation::FrontoParallel(depth));
        }
    } else {
        ways.push(Extrapolation::Plane);
    }
    let mut best: Option<Candidate> = None;
    for (stiffness, tight_at_border) in FITS {
        for &extrapolation in &ways {
            let shape = SurfaceShape { stiffness, extrapolation, tight_at_border };
            let Some(surface) = known.surface(shape)? else { continue };
            let flaws = prediction.flaws(other.model, &|point| surface.at(point))?.sum;
            if best.as_ref().is_none_or(|best| flaws < best.flaws) {
                best = Some(Candidate { surface, shape, flaws });
            }
        }
    }
    Ok(best)
}

/// The median of the inverse depth outside of the other photo, next to what is infinitely far and has these `slopes`. `None` where nothing is
/// outside.
fn depth_outside(surface: &Surface, [a, b]: [f64; 2], other: OtherView<'_>, size: (usize, usize)) -> Option<f64> {
    let outside = grid_points(size, POINTS).filter(|point| other.distance(*point, surface.at(*point)) > 0.0);
    median(outside.map(|[x, y]| surface.at([x, y]) - a * x - b * y).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Matrix3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::{EstimateOptions, Frame, Model, estimate};

    #[test]
    fn a_homography_that_misses_little_needs_no_lead() {
        let lead = |misalignment| homography_lead(Flaws { sum: 1.0, misalignment });
        assert!([0.0, MISSED[0]].map(lead) == [0.0; 2] && [MISSED[1], 0.1].map(lead) == [HOMOGRAPHY_LEAD; 2]);
        assert!((lead(0.5 * (MISSED[0] + MISSED[1])) - 0.5 * HOMOGRAPHY_LEAD).abs() < 1e-12);
    }

    #[test]
    fn a_floor_seen_from_elsewhere_was_not_seen_by_turning() {
        let (sizes, focal) = ([(1200, 900); 2], 1000.0);
        let k = Matrix3::new(focal, 0.0, 599.5, 0.0, focal, 449.5, 0.0, 0.0, 1.0);
        let (sin, cos) = libm::sincos(0.5);
        let turn = k * Matrix3::new(cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos) * k.try_inverse().unwrap();
        // What is low in the photo is near, and moves farther.
        let floor = Matrix3::new(1.0, -0.8, 300.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        for (truth, turned) in [(turn, true), (floor, false)] {
            let truth = Model::homography(truth);
            let points = (0..100).map(|i| [400.0 + (i % 10) as f64 * 60.0, 50.0 + (i / 10) as f64 * 80.0]);
            let pair = |[x, y]: [f64; 2]| Match { target: [x, y], reference: truth.project(x, y, 0.0).unwrap() };
            let matches: Vec<Match> = points.map(pair).collect();
            let frames = sizes.map(|size| Frame { size, depth: None });
            let found = estimate(&matches, frames[0], frames[1], &EstimateOptions::default(), &mut ()).unwrap();
            assert_eq!(rotation_like(&found, &matches, sizes, Some(focal)).is_some(), turned);
        }
    }
}
