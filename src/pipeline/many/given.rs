//! Depth maps that photos come with, brought to the unit of the cameras.

use super::depth::PhotoDepth;
use crate::depth::{CompletionOptions, KnownDepth, OtherView};
use crate::geometry::{DepthSample, MultiView, MultiViewKind};
use crate::line_fit::LineFit;
use crate::observer::Observer;
use crate::rect::diagonal;
use crate::statistics::median;
use crate::{ImageView, InverseDepth, Result};

/// Fewer landmarks say nothing of a map.
const FEWEST: usize = 20;
/// A map is taken if half of the landmarks are where it puts them up to this, as a share of the diagonal: 3 pixels of 800.
const TOLERANCE: f64 = 0.004;
/// A simpler relation is taken if its median error is no more than so many times that of a general one, or below a tenth of a pixel.
const AS_GOOD: f64 = 1.2;
const EXACT: f64 = 0.1;
/// Reweightings of least squares.
const PASSES: usize = 20;

/// The `own` map of the first photo in the unit of the cameras, its holes completed: a·d + b by its landmarks, with a = 1 and b = 0 or with b = 0 if
/// that is as good. `None` where the map contradicts them, or nothing ties it to them. The other photo is one that sees the same.
pub(super) fn given_depth(
    own: &InverseDepth,
    [photo, other]: [usize; 2],
    photos: &[ImageView<'_>],
    geometry: &MultiView,
    observer: &mut dyn Observer,
) -> Result<Option<PhotoDepth>> {
    let Some(model) = geometry.model([photo, other]).filter(|_| geometry.kind == MultiViewKind::Cameras) else {
        return Ok(None);
    };
    let both = |s: DepthSample| Some((own.sample(s.point[0], s.point[1]), s)).filter(|(d, _)| !d.is_nan());
    let pairs: Vec<(f64, DepthSample)> = geometry.samples(photo, other).into_iter().filter_map(both).collect();
    let relation = if pairs.len() < FEWEST {
        geometry.is_given().then_some(([1.0, 0.0], 0.0))
    } else {
        relation(&pairs, geometry.is_given()).filter(|(_, error)| *error < TOLERANCE * diagonal(photos[other].size()))
    };
    let Some(([a, b], prediction_error)) = relation else { return Ok(None) };
    let map = own.map_indexed(|_, d| (a * f64::from(d) + b) as f32)?;
    if map.data().iter().all(|d| !d.is_nan()) {
        return Ok(Some(PhotoDepth { map, prediction_error, given: true }));
    }
    let seen = OtherView::new(&model, photos[other].size());
    let known = KnownDepth::new(map, Some(photos[photo]), seen, &[], observer)?;
    let completed = known.completed(&CompletionOptions::default())?;
    Ok(completed.map(|map| PhotoDepth { map, prediction_error, given: true }))
}

/// a and b, and the median error in pixels of the other photo. `metric` maps may be in the right unit already.
fn relation(pairs: &[(f64, DepthSample)], metric: bool) -> Option<([f64; 2], f64)> {
    let error =
        |[a, b]: [f64; 2]| median(pairs.iter().map(|(d, s)| ((a * d + b - s.depth) * s.parallax).abs()).collect());
    let itself = metric.then_some([1.0, 0.0]);
    let candidates = [itself, fit(pairs, false), fit(pairs, true)];
    let found: Vec<([f64; 2], f64)> =
        candidates.into_iter().flatten().filter(|ab| ab[0] > 0.0).filter_map(|ab| Some((ab, error(ab)?))).collect();
    let least = found.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
    found.into_iter().find(|(_, error)| *error <= (AS_GOOD * least).max(EXACT))
}

/// a and b by the least sum of distances in the other photo, by reweighted least squares; b = 0 unless `shifted`.
fn fit(pairs: &[(f64, DepthSample)], shifted: bool) -> Option<[f64; 2]> {
    let mut best: Option<[f64; 2]> = None;
    for _ in 0..PASSES {
        let mut fit = LineFit::default();
        for (d, s) in pairs {
            let off = best.map_or(1.0, |[a, b]| ((a * d + b - s.depth) * s.parallax).abs().max(EXACT));
            fit.add(*d, s.depth, s.parallax * s.parallax / off);
        }
        let line = if shifted { fit.line()? } else { [fit.proportion(), 0.0] };
        if line.iter().any(|value| !value.is_finite()) {
            return None;
        }
        best = Some(line);
    }
    best
}
