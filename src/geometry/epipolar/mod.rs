//! Epipolar geometry of two photos: the fundamental matrix, and with it plane + parallax, which gives every match a relative
//! inverse depth.

mod fundamental;
mod refine;
mod search;
mod seven_point;
mod triangulation;

use super::clean::{Usable, clean, spread};
use super::errors::{Scales, count};
use super::estimate::{FEW, concluded};
use super::plane::DepthSample;
use super::points::{Normalisation, Points, Projection};
use super::ransac::Search;
use super::{Estimate, EstimateOptions, Frame, Match, Model, ModelKind, Threshold, estimate};
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::sampler::Sampler;
use crate::statistics::meaningful_consensus;
use crate::{Error, Result, Stage};
use search::{Epipolar, search};
use triangulation::{Triangulated, plane_parallax};

/// What the matches of two photos tell without depth maps.
#[derive(Debug, Clone)]
pub(crate) struct TwoViewGeometry {
    /// Both models, of kind [`ModelKind::TwoView`], the reverse one being the inverse of the forward one: H⁻¹, −H⁻¹e. Or
    /// the homography, when parallax is not observable.
    pub estimate: Estimate,
    /// Relative inverse depth at the inliers, in the target and in the reference; `None` with a homography.
    pub samples: Option<[Vec<DepthSample>; 2]>,
}

/// Finds the epipolar geometry of the matches, and a relative inverse depth of each.
///
/// When the matches show no parallax beyond what a homography explains (a flat scene, a pure rotation, fewer than 30
/// matches that agree on one epipolar geometry) that homography is returned, with [`Warning::ParallaxUnobservable`].
///
/// # Errors
/// Those of [`estimate`] without depth.
pub(crate) fn two_view_geometry(
    matches: &[Match],
    sizes: [(usize, usize); 2],
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<TwoViewGeometry> {
    let frames = sizes.map(|size| Frame { size, depth: None });
    // What a homography explains is no parallax; but where there is much of it, no homography may be found.
    let flat = match estimate(matches, frames[0], frames[1], options, observer) {
        Err(error) if matches!(*error, Error::NoConsensus { .. }) => Err(error),
        other => Ok(other?),
    };
    let usable = clean(matches, [&frames[0], &frames[1]]);
    let scene = PlaneParallax::of(&usable, flat.as_ref().ok().map(|flat| &flat.forward), options);
    report(observer, Stage::Depth, 0.1)?;
    let Some(scene) = scene else {
        let mut estimate = flat?;
        for warning in &mut estimate.warnings {
            if *warning == Warning::NoDepth {
                *warning = Warning::ParallaxUnobservable;
            }
        }
        return Ok(TwoViewGeometry { estimate, samples: None });
    };
    let samples = [0, 1].map(|side| scene.samples(&usable, side));
    Ok(TwoViewGeometry { estimate: scene.estimate(&usable, matches.len()), samples: Some(samples) })
}

/// Epipolar geometry with parallax.
struct PlaneParallax {
    epipolar: Epipolar,
    /// In pixels, target to reference and back.
    models: [Model; 2],
    matches: Vec<Triangulated>,
    /// What chose the inliers, in pixels.
    threshold: f64,
}

impl PlaneParallax {
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

    /// The matches on one side, with depth in that photo.
    fn samples(&self, usable: &[Usable], side: usize) -> Vec<DepthSample> {
        let model = &self.models[side];
        let sample = |m: &Triangulated| {
            let (point, depth) = (usable[m.index].ends[side], m.depth[side]);
            DepthSample { point, depth, parallax: model.parallax(point, depth) }
        };
        self.matches.iter().map(sample).collect()
    }

    #[inline(never)]
    fn estimate(&self, usable: &[Usable], passed: usize) -> Estimate {
        let inlying: Vec<Usable> = self.matches.iter().map(|m| usable[m.index]).collect();
        let models = &self.models;
        let error = |m: &Usable, side: usize| {
            models[side].epipolar_distance(m.ends[side], m.ends[1 - side]).unwrap_or(f64::INFINITY)
        };
        let found = concluded(&inlying, *models, ModelKind::TwoView, [passed, usable.len()], &error);
        Estimate { threshold: self.threshold, trials: self.epipolar.trials, ..found }
    }
}

/// The chance that a wrong match, which lies anywhere, is within the threshold of its line.
fn chance(usable: &[Usable], threshold: f64) -> f64 {
    let [narrow, wide] = spread(usable, 1);
    (2.0 * threshold / (12.0 * narrow * wide).sqrt()).min(1.0)
}
