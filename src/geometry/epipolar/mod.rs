//! Epipolar geometry of two photos: the fundamental matrix, and with it plane + parallax, which gives every match a relative
//! inverse depth.

mod cameras;
mod consensus;
mod essential;
mod fundamental;
mod infinity;
mod orientation;
mod pure_rotation;
mod refine;
mod seven_point;
mod triangulation;

use super::correspondences::{Correspondences, ProjectionMatrix};
use super::normalisation::Normalisation;
use super::plane::DepthSample;
use super::ransac::Config;
use super::ransac::score::{Scales, count};
use super::summary::{FEW, summarise};
use super::usable::{Usable, scatter_area, usable_matches};
use super::{Estimate, EstimateOptions, Frame, Match, Model, ModelKind, Threshold, estimate};
use crate::observer::Observer;
use crate::sampler::Sampler;
use crate::statistics::meaningful_consensus;
use crate::{Error, Result};
use consensus::{Epipolar, search};
pub(super) use essential::{Motion, Rays, decompose, in_front};
pub(crate) use infinity::plane_at_infinity;
use orientation::is_inverted;
pub(crate) use pure_rotation::pure_rotation;
pub(super) use pure_rotation::rotation_between;
use triangulation::{Triangulated, plane_parallax};

/// Samples drawn in any case: most of those without outliers determine little, as on one plane.
const MIN_TRIALS: u32 = 200;

/// The geometry of two photos without depth maps.
#[derive(Debug, Clone)]
pub(crate) struct TwoViewGeometry {
    /// Both models, of kind [`ModelKind::TwoView`], the reverse one being the inverse of the forward one: H⁻¹, −H⁻¹e. Or
    /// the homography, if parallax is not observable.
    pub estimate: Estimate,
    /// Relative inverse depth at the inliers, in the target and in the reference; `None` with a homography.
    pub samples: Option<[Vec<DepthSample>; 2]>,
}

/// Finds the epipolar geometry of the matches, and a relative inverse depth of each.
///
/// If the matches show no parallax beyond what a homography explains (a flat scene, a pure rotation, fewer than 30
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
    // Only what no homography explains is parallax. With much parallax, no homography may be found.
    let homography = match estimate(matches, frames[0], frames[1], options, observer) {
        Err(error) if matches!(*error, Error::NoConsensus { .. }) => Err(error),
        other => Ok(other?),
    };
    let usable = usable_matches(matches, [&frames[0], &frames[1]]);
    let plane = homography.as_ref().ok().map(|homography| &homography.forward);
    let scene = PlaneParallax::find(&usable, plane, options);
    let Some(mut scene) = scene else {
        return Ok(TwoViewGeometry { estimate: homography?.without_parallax(), samples: None });
    };
    scene.orient(&usable, sizes);
    let samples = [0, 1].map(|side| scene.samples(&usable, side));
    Ok(TwoViewGeometry { estimate: scene.estimate(&usable, matches.len()), samples: Some(samples) })
}

/// Whether the matches show parallax beyond a homography, whatever depth maps say of it.
pub(super) fn has_unexplained_parallax(usable: &[Usable], homography: &Model, options: &EstimateOptions) -> bool {
    PlaneParallax::find(usable, Some(homography), options).is_some()
}

/// Epipolar geometry with parallax.
struct PlaneParallax {
    epipolar: Epipolar,
    /// In pixels, target to reference and back.
    models: [Model; 2],
    matches: Vec<Triangulated>,
    /// The threshold of the inliers, in pixels.
    threshold: f64,
}

impl PlaneParallax {
    /// `None` if the matches show no more parallax than the homography of a `plane` explains.
    fn find(usable: &[Usable], plane: Option<&Model>, options: &EstimateOptions) -> Option<Self> {
        let mut points = Correspondences::default();
        usable.iter().for_each(|m| points.push(m.ends[0], 0.0, m.ends[1]));
        let units = Normalisation::isotropic(&points);
        let points = units.apply(&points);
        let plane = plane.map(|plane| units.projection(plane));
        let threshold = match options.threshold {
            Threshold::Pixels(t) => t * units.scale(),
            Threshold::Normalised(t) => t,
        };
        let config = Config {
            // Only the error across the line counts, and a wide band along the epipolar lines admits many outliers.
            scales: Scales::between(threshold, threshold / 3.0),
            confidence: options.confidence,
            max_trials: options.max_trials,
            min_trials: MIN_TRIALS,
            local_iterations: 1,
        };
        let epipolar = search(&points, plane.as_ref(), &config, &mut Sampler::new(options.seed))?;
        let chance = chance(usable, epipolar.threshold / units.scale());
        let needed = meaningful_consensus(usable.len(), seven_point::SAMPLE, chance);
        let shown = |plane: &ProjectionMatrix| epipolar.shows_parallax(&points, plane, units.scale(), chance);
        if count(epipolar.inliers.iter().copied()) < needed || !plane.as_ref().is_none_or(shown) {
            return None;
        }
        let (projection, matches) = plane_parallax(&points, &epipolar.inliers, &epipolar.fundamental, units.scale())?;
        let forward = units.model(&projection);
        let models = [forward, forward.inverse()?];
        // A few are not enough for dense depth.
        (matches.len() >= needed.max(FEW)).then_some(Self {
            threshold: epipolar.threshold / units.scale(),
            epipolar,
            models,
            matches,
        })
    }

    /// Has larger values of the inverse depth mean nearer.
    fn orient(&mut self, usable: &[Usable], sizes: [(usize, usize); 2]) {
        let ends: Vec<_> = self.matches.iter().map(|m| usable[m.index].ends).collect();
        if is_inverted(&self.models[0], &ends, sizes) {
            self.models.iter_mut().for_each(|model| model.e = -model.e);
            self.matches.iter_mut().for_each(|m| m.depth = m.depth.map(|depth| -depth));
        }
    }

    /// The matches on one side, with depth in that photo.
    fn samples(&self, usable: &[Usable], side: usize) -> Vec<DepthSample> {
        let model = &self.models[side];
        let sample = |m: &Triangulated| DepthSample::new(model, usable[m.index].ends[side], m.depth[side]);
        self.matches.iter().map(sample).collect()
    }

    fn estimate(&self, usable: &[Usable], passed: usize) -> Estimate {
        let inlying: Vec<Usable> = self.matches.iter().map(|m| usable[m.index]).collect();
        let models = &self.models;
        let error = |m: &Usable, side: usize| models[side].epipolar_distance(m.ends[side], m.ends[1 - side]);
        let found = summarise(&inlying, *models, ModelKind::TwoView, [passed, usable.len()], error);
        Estimate { threshold: self.threshold, trials: self.epipolar.trials, ..found }
    }
}

/// The probability that an outlier is within the threshold of its epipolar line.
fn chance(usable: &[Usable], threshold: f64) -> f64 {
    (2.0 * threshold / scatter_area(usable).sqrt()).min(1.0)
}
