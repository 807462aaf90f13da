//! Inverse depth from the two photos alone: dense maps through the relative inverse depth of the matches.

use super::interpolation::{Kernel, Sample, Scattered};
use crate::geometry::{DepthSample, Estimate, EstimateOptions, Match, two_view_geometry};
use crate::observer::{Observer, Portion};
use crate::rect::diagonal;
use crate::statistics::{evenly_chosen, nth};
use crate::{ImageView, InverseDepth, Result};

/// Without matches around of like colour the depth soon is that of the plane: extrapolations would differ between both photos.
const NEAR: Kernel = Kernel { near: 0.015, ridge: 1e-4, far: 0.06, sharp: true, nodes: 150.0 };
/// Matches that predict each other well support the depth far from all of them as well.
const WIDE: Kernel = Kernel { near: 0.06, far: 0.3, nodes: 40.0, ..NEAR };
/// The largest leave-one-out error for that, as a share of the diagonal. Tuned on the evaluation cases: half costs 0.8 % of PSNR, twice
/// changes nothing.
const PREDICTABLE: f64 = 0.0025;

/// Most matches that the maps go through, evenly chosen: time grows with their square. A dense matcher has ten times as many. On a pair with 6000 matches
/// half of them cost 1.2 dB.
const MOST_SAMPLES: usize = 8000;

/// The part of the stage at which the map of the reference begins.
pub(crate) const SECOND_MAP: f32 = 0.55;

/// Geometry and depth of two photos.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoView {
    /// Both models, of kind [`ModelKind::TwoView`](crate::geometry::ModelKind::TwoView), the reverse one being the inverse of the forward one: H⁻¹, −H⁻¹e. Or
    /// the homography, when parallax is not observable. The residuals are distances from the epipolar lines.
    pub geometry: Estimate,
    /// Relative inverse depth of the target, of its size: 0 on the plane that most matches are near to, mean square 1 at
    /// the matches. 0 everywhere with a homography.
    pub target: InverseDepth,
    /// The same of the reference: what the target shows with g appears there with g/λ, λ being the third coordinate of
    /// its image.
    pub reference: InverseDepth,
    /// Leave-one-out error of the maps: how far they miss a match that was left out, in pixels of the other photo, the 90th
    /// percentile, forward and reverse.
    pub prediction_error: [f64; 2],
}

/// Finds the epipolar geometry of the matches and a relative inverse depth of both photos that goes with it.
///
/// Two photos determine the depth up to an affine change, which leaves the map from one to the other as it is. Between the
/// matches the depth follows the colours of the photos; far from all of them it is extrapolated as far as they predict each other,
/// and beyond is that of the plane most are near to.
/// When the matches show no parallax beyond what a homography explains (a flat scene, a pure rotation, fewer than 30
/// matches that agree on one epipolar geometry) that homography is returned, with [`Warning::ParallaxUnobservable`](crate::report::Warning::ParallaxUnobservable).
///
/// # Errors
/// Those of [`estimate`](crate::geometry::estimate) without depth; `out-of-memory`, `aborted`.
pub fn two_view(
    matches: &[Match],
    target: ImageView<'_>,
    reference: ImageView<'_>,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<TwoView> {
    let geometry = two_view_geometry(matches, [target.size(), reference.size()], options, observer)?;
    let estimate = geometry.estimate;
    let Some(samples) = geometry.samples else {
        let zero = |image: ImageView<'_>| InverseDepth::constant(0.0, image.width(), image.height());
        return Ok(TwoView {
            prediction_error: estimate.residual,
            geometry: estimate,
            target: zero(target)?,
            reference: zero(reference)?,
        });
    };
    let (target, forward) = target_map(&samples[0], target, observer)?;
    let (reference, reverse) = reference_map(&samples[1], reference, observer)?;
    Ok(TwoView { geometry: estimate, target, reference, prediction_error: [forward, reverse] })
}

/// The map of the target and its prediction error, after the geometry and before the map of the reference: see [`TwoView`].
pub(crate) fn target_map(
    ends: &[DepthSample],
    target: ImageView<'_>,
    observer: &mut dyn Observer,
) -> Result<(InverseDepth, f64)> {
    dense(ends, target, &mut Portion::new(observer, 0.1, SECOND_MAP))
}

/// The map of the reference, and its prediction error.
pub(crate) fn reference_map(
    ends: &[DepthSample],
    reference: ImageView<'_>,
    observer: &mut dyn Observer,
) -> Result<(InverseDepth, f64)> {
    dense(ends, reference, &mut Portion::new(observer, SECOND_MAP, 1.0))
}

/// The dense map of one photo through `ends`, relative to a plane and of mean square 1 there, and its prediction error: see
/// [`TwoView`].
pub(crate) fn dense(
    ends: &[DepthSample],
    image: ImageView<'_>,
    observer: &mut dyn Observer,
) -> Result<(InverseDepth, f64)> {
    let ends: Vec<&DepthSample> = evenly_chosen(ends, MOST_SAMPLES).collect();
    // All points are localised equally well, so a depth is the better known the more it moves its point.
    let mean = ends.iter().map(|m| m.parallax * m.parallax).sum::<f64>() / ends.len() as f64;
    let mut samples: Vec<Sample> = ends
        .iter()
        .map(|m| Sample { point: m.point, value: m.depth, weight: m.parallax * m.parallax / mean })
        .collect();
    let size = image.size();
    let mut scattered = Scattered::new(&samples, NEAR, size, Some(image));
    let errors: Vec<f64> =
        ends.iter().enumerate().map(|(i, m)| (scattered.without(i) - m.depth).abs() * m.parallax).collect();
    let most = 9 * errors.len() / 10;
    let prediction_error = nth(errors, most).unwrap_or(0.0);
    // From coarse to fine: what is near goes through what the wide map has left.
    let mut wide = None;
    if prediction_error < PREDICTABLE * diagonal(size) {
        let map = Scattered::new(&samples, WIDE, size, Some(image)).dense(&mut Portion::new(observer, 0.0, 0.5))?;
        samples.iter_mut().for_each(|s| s.value -= map.sample(s.point[0], s.point[1]));
        scattered = Scattered::new(&samples, NEAR, size, Some(image));
        wide = Some(map);
    }
    let mut sum =
        scattered.dense(&mut Portion::new(observer, if wide.is_some() { 0.5 } else { 0.0 }, 1.0))?.into_values();
    if let Some(wide) = wide {
        sum.iter_mut().zip(wide.data()).for_each(|(sum, v)| *sum += v);
    }
    Ok((InverseDepth::from_values(sum, size.0, size.1), prediction_error))
}
