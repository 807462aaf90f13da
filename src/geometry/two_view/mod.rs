//! Inverse depth from the two photos alone: epipolar geometry, plane and parallax, a dense map through the matches.

mod affine;
mod continuation;
mod densify;
mod derive;
mod fundamental;
mod parallax;
mod polish;
mod pyramid;
mod search;
mod seven_point;

pub use continuation::continue_outside;
pub use derive::{derive_depth, derive_missing};

use super::clean::{Usable, clean, spread};
use super::errors::{Scales, count};
use super::estimate::{FEW, concluded};
use super::points::{Normalisation, Points, Projection};
use super::ransac::Search;
use super::sampler::Sampler;
use super::statistics::{meaningful_consensus, nth};
use super::vectors::cross;
use super::{Estimate, EstimateOptions, Frame, Match, Model, ModelKind, Threshold, estimate};
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::{Error, ImageView, InverseDepth, Result, Stage};
use affine::Moving;
use densify::{Kernel, Sample, Scattered, diagonal};
use parallax::{Parallax, plane_parallax};
use search::{Epipolar, search};

/// Without matches around of like colour the depth soon is that of the plane: guesses would differ between both photos.
const NEAR: Kernel = Kernel { near: 0.015, ridge: 1e-4, far: 0.06, sharp: true, nodes: 150.0 };
/// Matches that foretell each other well may speak for what is far from all of them.
const WIDE: Kernel = Kernel { near: 0.06, far: 0.3, nodes: 40.0, ..NEAR };
/// How well, as a share of the diagonal.
const FORETOLD: f64 = 0.0025;

/// Geometry and depth of two photos.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoView {
    /// Both models, of kind [`ModelKind::TwoView`], the reverse one being the inverse of the forward one: H⁻¹, −H⁻¹e. Or
    /// the homography, when parallax is not observable. The residuals are distances from the epipolar lines.
    pub geometry: Estimate,
    /// Relative inverse depth of the target, of its size: 0 on the plane that most matches are near to, mean square 1 at
    /// the matches. 0 everywhere with a homography.
    pub target: InverseDepth,
    /// The same of the reference: what the target shows with g appears there with g/λ, λ being the third coordinate of
    /// its image.
    pub reference: InverseDepth,
    /// How well the maps foretell where a match is that did not take part in them, in pixels of the other photo: the 90th
    /// percentile of the error, forward and reverse.
    pub spread: [f64; 2],
}

/// Finds the epipolar geometry of the matches and a relative inverse depth of both photos that goes with it.
///
/// Two photos determine the depth up to an affine change, which leaves the map from one to the other as it is. Between the
/// matches the depth follows the colours of the photos; far from all of them it goes on as far as they foretell each other,
/// and beyond is that of the plane most are near to.
/// When the matches show no parallax beyond what a homography explains (a flat scene, a pure rotation, fewer than 30
/// matches that agree on one epipolar geometry) that homography is returned, with [`Warning::ParallaxUnobservable`].
///
/// # Errors
/// Those of [`estimate`] without depth; `out-of-memory`, `aborted`.
pub fn two_view(
    matches: &[Match],
    target: ImageView<'_>,
    reference: ImageView<'_>,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<TwoView> {
    let frames = [target, reference].map(|image| Frame { size: (image.width(), image.height()), depth: None });
    // What a homography explains is no parallax; but where there is much of it, no homography may be found.
    let flat = match estimate(matches, frames[0], frames[1], options, observer) {
        Err(error) if matches!(*error, Error::NoConsensus { .. }) => Err(error),
        other => Ok(other?),
    };
    let usable = clean(matches, [&frames[0], &frames[1]]);
    let scene = Scene::of(&usable, flat.as_ref().ok().map(|flat| &flat.forward), options);
    report(observer, Stage::Depth, 0.1)?;
    let Some(scene) = scene else {
        let mut geometry = flat?;
        for warning in &mut geometry.warnings {
            if *warning == Warning::NoDepth {
                *warning = Warning::ParallaxUnobservable;
            }
        }
        let zero = |image: ImageView<'_>| InverseDepth::constant(0.0, image.width(), image.height());
        return Ok(TwoView { spread: geometry.residual, geometry, target: zero(target)?, reference: zero(reference)? });
    };
    let (target, forward) = scene.dense(&usable, 0, target, observer)?;
    let (reference, reverse) = scene.dense(&usable, 1, reference, observer)?;
    let geometry = scene.estimate(&usable, matches.len());
    Ok(TwoView { geometry, target, reference, spread: [forward, reverse] })
}

/// Epipolar geometry with parallax.
struct Scene {
    epipolar: Epipolar,
    /// In pixels, target to reference and back.
    models: [Model; 2],
    matches: Vec<Parallax>,
    /// What chose the inliers, in pixels.
    threshold: f64,
}

impl Scene {
    /// `None` when the matches show no more parallax than `plane` explains.
    #[inline(never)]
    fn of(usable: &[Usable], plane: Option<&Model>, options: &EstimateOptions) -> Option<Self> {
        let mut points = Points::default();
        usable.iter().for_each(|m| points.push(m.ends[0], 0.0, m.ends[1]));
        let units = Normalisation::isotropic(&points);
        let points = units.apply(&points);
        let plane = plane.map(|plane| units.projection(plane));
        let threshold = match options.threshold {
            Threshold::Pixels(t) => t * units.scale(),
            Threshold::Normalised(t) => t,
        };
        // A match errs in one direction only, and a wide band along the epipolar lines lets many wrong ones in.
        let scales = Scales::between(threshold, threshold / 3.0);
        let how = Search { scales, confidence: options.confidence, max_trials: options.max_trials, local: true };
        let epipolar = search(&points, plane.as_ref(), &how, &mut Sampler::new(options.seed))?;
        let chance = chance(usable, epipolar.threshold / units.scale());
        let needed = meaningful_consensus(usable.len(), seven_point::SAMPLE, chance);
        let shown = |plane: &Projection| epipolar.shows_parallax(&points, plane, units.scale(), chance);
        if count(&epipolar.inliers) < needed || !plane.as_ref().is_none_or(shown) {
            return None;
        }
        let (projection, matches) = plane_parallax(&points, &epipolar.inliers, &epipolar.fundamental, units.scale())?;
        let forward = units.model(&projection);
        let models = [forward, forward.inverse()?];
        // From a few no dense depth can be made.
        (matches.len() >= needed.max(FEW)).then_some(Self {
            threshold: epipolar.threshold / units.scale(),
            epipolar,
            models,
            matches,
        })
    }

    /// The dense map of the target (side 0) or the reference (side 1), and its spread.
    fn dense(
        &self,
        usable: &[Usable],
        side: usize,
        image: ImageView<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(InverseDepth, f64)> {
        let mut ends = Vec::new();
        for m in &self.matches {
            let (point, depth) = (usable[m.index].ends[side], m.depth[side]);
            ends.push(Moving { point, depth, motion: motion(&self.models[side], point, depth) });
        }
        // All points are localised alike, so a depth is the better known the more it moves its point.
        let mean = ends.iter().map(|m| m.motion * m.motion).sum::<f64>() / ends.len() as f64;
        let mut samples: Vec<Sample> = ends
            .iter()
            .map(|m| Sample { point: m.point, value: m.depth, weight: m.motion * m.motion / mean })
            .collect();
        let size = (image.width(), image.height());
        let mut scattered = Scattered::new(&samples, NEAR, size, Some(image));
        let errors: Vec<f64> =
            ends.iter().enumerate().map(|(i, m)| (scattered.without(i) - m.depth).abs() * m.motion).collect();
        let most = 9 * errors.len() / 10;
        let spread = nth(errors, most).unwrap_or(0.0);
        // From coarse to fine: what is near goes through what the wide map has left.
        let mut wide = None;
        if spread < FORETOLD * diagonal(size) {
            let map = Scattered::new(&samples, WIDE, size, Some(image)).dense(observer)?;
            samples.iter_mut().for_each(|s| s.value -= map.sample(s.point[0], s.point[1]));
            scattered = Scattered::new(&samples, NEAR, size, Some(image));
            wide = Some(map);
        }
        let mut sum = scattered.dense(observer)?.into_values();
        if let Some(wide) = wide {
            sum.iter_mut().zip(wide.data()).for_each(|(sum, v)| *sum += v);
        }
        Ok((InverseDepth::from_values(sum, size.0, size.1), spread))
    }

    #[inline(never)]
    fn estimate(&self, usable: &[Usable], passed: usize) -> Estimate {
        let inlying: Vec<Usable> = self.matches.iter().map(|m| usable[m.index]).collect();
        let models = &self.models;
        let error = |m: &Usable, side: usize| distance(&models[side], m.ends[side], m.ends[1 - side]);
        let found = concluded(&inlying, *models, ModelKind::TwoView, [passed, usable.len()], &error);
        Estimate { threshold: self.threshold, trials: self.epipolar.trials, ..found }
    }
}

/// The chance that a wrong match, which lies anywhere, is within the threshold of its line.
fn chance(usable: &[Usable], threshold: f64) -> f64 {
    let [narrow, wide] = spread(usable, 1);
    (2.0 * threshold / (12.0 * narrow * wide).sqrt()).min(1.0)
}

/// By how many pixels the image of a point moves per inverse depth.
#[inline(never)]
fn motion(model: &Model, [x, y]: [f64; 2], d: f64) -> f64 {
    let [u, v, w] = model.transform(x, y, d);
    let [du, dv] = [(model.e[0] - u / w * model.e[2]) / w, (model.e[1] - v / w * model.e[2]) / w];
    (du * du + dv * dv).sqrt()
}

/// How far a point is from the epipolar line it should be on, in pixels.
fn distance(model: &Model, [x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    let e = [model.e[0], model.e[1], model.e[2]];
    let [a, b, c] = cross(e, model.transform(x, y, 0.0));
    (a * u + b * v + c).abs() / (a * a + b * b).sqrt()
}
