//! Depth maps that are not exact, such as those of networks, where only one photo shows and stereo cannot correct them.

use super::completion::{LEAST_SAMPLES, REACH};
use super::holes::{self, Holes};
use super::surface::{Equations, OtherView, SurfaceShape, sample_grid, segments};
use crate::geometry::DepthSample;
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::rect::diagonal;
use crate::{ImageView, InverseDepth, Mask, Result, Stage};

/// How stiff the correction is, next to a surface of depth. Displacement outside, mean of the medians of the five cases with degraded maps:
/// 0.63 px, 0.76 with 1, 1.13 with 0.06.
const STIFFNESS: f64 = 0.25;

/// What was measured of a photo's inverse depth.
#[derive(Clone, Copy)]
pub(crate) struct MeasuredDepth<'a> {
    /// A map of it.
    pub map: &'a InverseDepth,
    /// Where that is reliable: not 0.
    pub reliable: &'a Mask,
    /// Points of known depth besides.
    pub matches: &'a [DepthSample],
}

/// Replaces the depth that was `measured` of a photo where it leads outside of the `other`: by the `prior` that it was measured
/// with, corrected.
///
/// What a network gets wrong varies slowly over the photo, so a smooth surface of corrections, which has no edges of its own, goes
/// through those of the reliable pixels and of the matches. It is extrapolated so that the corrected depth is affine along straight
/// lines. Measured and corrected depth meet a little inside of the border.
///
/// `None` when hardly anything was measured.
///
/// # Errors
/// `size-mismatch` for a photo, mask or prior of another size, `out-of-memory`, `aborted`.
pub(crate) fn correct_outside(
    measured: &MeasuredDepth<'_>,
    prior: &InverseDepth,
    photo: ImageView<'_>,
    other: OtherView<'_>,
    observer: &mut dyn Observer,
) -> Result<Option<InverseDepth>> {
    let MeasuredDepth { map, reliable, matches } = *measured;
    let (w, h) = map.size();
    check_size("reliable", reliable.size(), (w, h))?;
    check_size("photo", photo.size(), (w, h))?;
    check_size("prior", prior.size(), (w, h))?;
    report(observer, Stage::Refine, 0.0)?;
    let Some(prior) = holes::resolve(Some(prior), Holes::Nearest)? else { return Ok(None) };
    // By how much the prior is wrong there.
    let wrong = |s: DepthSample| DepthSample { depth: s.depth - prior.sample(s.point[0], s.point[1]), ..s };
    let mut samples = Vec::new();
    for (x, y) in sample_grid((w, h)).filter(|(x, y)| reliable.data()[y * w + x] != 0) {
        let (point, depth) = ([x as f64, y as f64], f64::from(map.data()[y * w + x]));
        if other.contains(point, depth) {
            samples.push(wrong(DepthSample::new(other.model, point, depth)));
        }
    }
    if samples.len() + matches.len() < LEAST_SAMPLES {
        return Ok(None);
    }
    let matches: Vec<DepthSample> = matches.iter().copied().map(wrong).collect();
    let segments = segments(photo, false)?;
    report(observer, Stage::Refine, 0.5)?;
    let shape = SurfaceShape { stiffness: STIFFNESS, ..SurfaceShape::default() };
    let surface = match Equations::of_correction(&samples, &matches, &prior, &segments)? {
        Some(mut equations) => equations.solve(&other, shape)?,
        None => None,
    };
    let Some(surface) = surface else { return Ok(None) };
    let mut values = surface.dense((w, h))?;
    let reach = REACH * diagonal(other.size);
    for (i, (value, (&prior, &own))) in values.iter_mut().zip(prior.data().iter().zip(map.data())).enumerate() {
        *value += prior;
        let point = [(i % w) as f64, (i / w) as f64];
        let share = (other.inset(point, f64::from(*value)) / reach).clamp(0.0, 1.0);
        *value += share as f32 * (own - *value);
    }
    report(observer, Stage::Refine, 1.0)?;
    Ok(Some(InverseDepth::from_values(values, w, h)))
}
