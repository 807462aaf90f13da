//! The fit of two calibrated cameras, and the choice between them and the free models.

mod cameras;
mod reprojection;

use super::correspondences::{Correspondences, ProjectionMatrix};
use super::levenberg_marquardt::minimise;
use super::normalisation::Normalisation;
use super::ransac::score::inliers_of;
use super::{Comparison, Model, Score};
use crate::statistics::median;
use cameras::{Cameras, PARAMETERS};
pub(super) use cameras::{nearest_rotation, small_rotation};
use reprojection::{CAP, Noise, Priors, Reprojection};

/// Focal lengths to start from, in diagonals: a wide-angle to a short telephoto lens (17 to 69 mm on a 35 mm camera). The
/// focal length is the one parameter whose cost has more than one minimum.
const STARTS: [f64; 4] = [0.4, 0.65, 1.0, 1.6];
/// Most matches that choose between the minima: enough for that, and fast.
const START_MATCHES: usize = 100;
/// The weak prior of ln(focal length in diagonals), with its standard deviation: most lenses have 21 to 43 mm on a 35 mm
/// camera.
pub(super) const LOG_FOCAL: [f64; 2] = [-0.35, 0.35];
/// The standard deviation of ln f for a given focal length: those in a photo's metadata are rounded.
pub(super) const PAIR_FOCAL_DEVIATION: f64 = 0.02;
/// Standard deviation of the inverse depth at infinity, which should be 0, as a fraction of the matches' median. A weak prior.
const SHIFT: f64 = 0.5;
/// That deviation at least, where depth has a variance of 1.
const LEAST_SHIFT: f64 = 1e-3;
/// Where least squares stop while the inliers still change, and in the end: when a step reduces the cost by less than this
/// fraction.
const COARSE: f64 = 1e-2;
const FINE: f64 = 1e-6;
/// Most iterations of one least-squares fit.
const ITERATIONS: usize = 30;
/// Least standard deviation of a point, in pixels: features are not localised better.
const MIN_SIGMA: f64 = 0.1;
/// Degrees of freedom of two depth models, one per direction.
const FREE_PARAMETERS: f64 = 22.0;

/// Two cameras in place of the free models.
pub(super) struct Calibrated {
    /// Forward and reverse.
    pub models: [Model; 2],
    /// In pixels of the target.
    pub focal: f64,
    pub comparison: Comparison,
}

/// Fits two cameras to the flagged matches, given in pixels for both directions, and to those that come within `threshold`
/// pixels; starts from the free models of both directions. `None` if that fails.
pub(super) fn calibrate(
    [forward, reverse]: &[Correspondences; 2],
    inliers: &[bool],
    [target, reference]: [(usize, usize); 2],
    models: &[Model; 2],
    threshold: f64,
    focal: Option<f64>,
) -> Option<Calibrated> {
    let mut both = [
        Direction::new(forward, inliers, [target, reference], &models[0]),
        Direction::new(reverse, inliers, [reference, target], &models[1]),
    ];
    let diagonal = 1.0 / both[0].normalisation.source_scale();
    let known = focal.map(|f| f / diagonal);
    let log_focal = known.map_or(LOG_FOCAL, |f| [libm::log(f), PAIR_FOCAL_DEVIATION]);
    let priors = Priors { log_focal, shift: [both[0].infinity, both[1].infinity] };
    let start = initial_cameras(&both, priors, known.as_ref().map_or(&STARTS, std::slice::from_ref))?;
    let cameras = fit_cameras(&mut both, priors, start, threshold)?;
    let projections = cameras.projections();
    let either: Vec<bool> = both[0].flags.iter().zip(inliers).map(|(a, b)| *a || *b).collect();
    both.iter_mut().for_each(|direction| direction.select(&either));
    Some(Calibrated {
        models: [0, 1].map(|k| both[k].normalisation.model(&projections[k])),
        focal: cameras.focal() * diagonal,
        comparison: compare(&both, &projections)?,
    })
}

/// Refines the cameras, selecting inliers and estimating the noise anew in each round. The free models' inliers can be a
/// chance consensus; the cameras, with fewer parameters to fit it, lead away from it.
fn fit_cameras(both: &mut [Direction; 2], priors: Priors, start: Cameras, threshold: f64) -> Option<Cameras> {
    const ROUNDS: usize = 6;
    let mut cameras = start;
    for round in 0..ROUNDS {
        let projections = cameras.projections();
        let noise = [both[0].noise(&projections[0])?, both[1].noise(&projections[1])?];
        let points = [&both[0].inliers, &both[1].inliers];
        let tolerance = if round < 2 { COARSE } else { FINE };
        cameras = minimise(&Reprojection { points, noise, priors }, cameras, tolerance, ITERATIONS).0;
        let flags = both[0].inliers_of(&cameras.projections()[0], threshold);
        if round >= 2 && flags == both[0].flags {
            break;
        }
        both.iter_mut().for_each(|direction| direction.select(&flags));
    }
    Some(cameras)
}

/// The best of several focal lengths in diagonals, by some of the inliers.
fn initial_cameras([forward, reverse]: &[Direction; 2], priors: Priors, focals: &[f64]) -> Option<Cameras> {
    let few = [forward, reverse].map(|direction| direction.inliers.subsample(START_MATCHES));
    let noise = [forward.noise(&forward.free)?, reverse.noise(&reverse.free)?];
    let problem = |scale: f64| Reprojection {
        points: [&few[0], &few[1]],
        noise: noise.map(|n| Noise { point: scale * n.point, depth: scale * n.depth, ..n }),
        priors,
    };
    let mut best: Option<(Cameras, f64)> = None;
    for &focal in focals {
        let Some(start) = Cameras::nearest([&forward.free, &reverse.free], focal) else { continue };
        // With ten times the noise first: far from the minimum, hardly a match would have any influence.
        let (start, _) = minimise(&problem(100.0), start, COARSE, ITERATIONS);
        let (cameras, cost) = minimise(&problem(1.0), start, COARSE, ITERATIONS);
        if best.is_none_or(|(_, least)| cost < least) {
            best = Some((cameras, cost));
        }
    }
    Some(best?.0)
}

/// Scores both pairs of models under the same noise: that of the points by the better of the two, that of the inverse depth
/// by the cameras, as free models absorb part of it in H∞.
fn compare(both: &[Direction; 2], cameras: &[ProjectionMatrix; 2]) -> Option<Comparison> {
    let (mut costs, mut exact) = ([0.0; 2], true);
    for (direction, projection) in both.iter().zip(cameras) {
        let (free, calibrated) = (direction.noise(&direction.free)?, direction.noise(projection)?);
        exact &= calibrated.exact;
        let noise = Noise { point: free.point.min(calibrated.point), ..calibrated };
        costs[0] += direction.cost(&direction.free, &noise);
        costs[1] += direction.cost(projection, &noise);
    }
    // Each match has two coordinates in each direction (Bayesian information criterion).
    let penalty = libm::log(4.0 * both[0].all.len() as f64);
    Some(Comparison {
        free: Score { cost: costs[0], penalty: FREE_PARAMETERS * penalty },
        calibrated: Score { cost: costs[1], penalty: PARAMETERS as f64 * penalty },
        exact,
    })
}

/// The matches of one direction, from the centres, in diagonals.
struct Direction {
    normalisation: Normalisation,
    all: Correspondences,
    /// Which of them are inliers, and only these.
    flags: Vec<bool>,
    inliers: Correspondences,
    /// The free model.
    free: ProjectionMatrix,
    /// The prior of the inverse depth at infinity: mean and standard deviation.
    infinity: [f64; 2],
}

impl Direction {
    fn new(pixels: &Correspondences, inliers: &[bool], [from, to]: [(usize, usize); 2], model: &Model) -> Self {
        let chosen = pixels.select(inliers);
        let normalisation = Normalisation::from_centres(&chosen, from, to);
        let middle = median(chosen.iter().map(|p| p.d).collect()).unwrap_or(0.0);
        let (zero, middle) = (normalisation.depth(0.0), normalisation.depth(middle));
        Self {
            all: normalisation.apply(pixels),
            inliers: normalisation.apply(&chosen),
            flags: inliers.to_vec(),
            free: normalisation.projection(model),
            // Where most of it is at infinity, that is known.
            infinity: [zero, (SHIFT * (middle - zero).abs()).max(LEAST_SHIFT)],
            normalisation,
        }
    }

    /// Which matches are within `threshold` pixels of their images.
    fn inliers_of(&self, p: &ProjectionMatrix, threshold: f64) -> Vec<bool> {
        inliers_of(&self.all, p, threshold * self.normalisation.scale())
    }

    fn select(&mut self, flags: &[bool]) {
        self.flags = flags.to_vec();
        self.inliers = self.all.select(flags);
    }

    fn noise(&self, p: &ProjectionMatrix) -> Option<Noise> {
        let min = MIN_SIGMA * self.normalisation.scale();
        Noise::estimate(&self.inliers, p, min * min)
    }

    /// Σ min(error, c²) over all matches.
    fn cost(&self, p: &ProjectionMatrix, noise: &Noise) -> f64 {
        self.all.iter().map(|point| noise.squared_error(point, p).min(CAP)).sum()
    }
}
