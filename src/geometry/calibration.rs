//! The fit of two calibrated cameras, and the choice between them and the free models.

use super::cameras::Cameras;
use super::errors::inliers_of;
use super::levenberg_marquardt::minimise;
use super::points::{Normalisation, Points, Projection};
use super::reprojection::{CAP, Noise, Priors, Reprojection};
use super::{Comparison, Model, Score};
use crate::statistics::median;

/// Focal lengths to start from, in diagonals: a wide angle to a short telephoto lens. The focal length is the one number
/// whose cost has more than one minimum.
const STARTS: [f64; 4] = [0.4, 0.65, 1.0, 1.6];
/// Matches that choose between the minima.
const START_MATCHES: usize = 100;
/// ln(focal length in diagonals) before anything is known, with its standard deviation: most lenses have 21 to 43 mm on a
/// 35 mm camera.
const LOG_FOCAL: [f64; 2] = [-0.35, 0.35];
/// The same standard deviation of a given focal length: those in a photo's file are rounded.
const KNOWN_FOCAL: f64 = 0.02;
/// Standard deviation of the inverse depth at infinity, which should be 0, as a share of the matches' median.
const SHIFT: f64 = 0.5;
/// Where least squares stop on the way and at the end: when a step gains less than this share of the cost.
const COARSE: f64 = 1e-2;
const FINE: f64 = 1e-6;
const TRIES: usize = 30;
/// Least standard deviation of a point, in pixels: features are not localised better.
const FINEST: f64 = 0.1;

/// Two cameras in place of the free models.
pub(super) struct Calibrated {
    /// Forward and reverse.
    pub models: [Model; 2],
    /// In pixels of the target.
    pub focal: f64,
    pub comparison: Comparison,
}

/// Fits two cameras to the flagged matches, given in pixels for both directions, and to those that come within `threshold`
/// pixels; starts from the free models of both directions. `None` when that fails.
pub(super) fn calibrate(
    [forward, reverse]: &[Points; 2],
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
    let log_focal = known.map_or(LOG_FOCAL, |f| [libm::log(f), KNOWN_FOCAL]);
    let priors = Priors { log_focal, shift: [both[0].infinity, both[1].infinity] };
    let start = started(&both, priors, known.as_ref().map_or(&STARTS, std::slice::from_ref))?;
    let cameras = fitted(&mut both, priors, start, threshold)?;
    let projections = cameras.projections();
    let either: Vec<bool> = both[0].flags.iter().zip(inliers).map(|(a, b)| *a || *b).collect();
    both.iter_mut().for_each(|direction| direction.choose(&either));
    Some(Calibrated {
        models: [0, 1].map(|k| both[k].normalisation.model(&projections[k])),
        focal: cameras.focal() * diagonal,
        comparison: compared(&both, &projections)?,
    })
}

/// The cameras, with the inliers and the noise that their own fit shows. The free models' inliers can be a chance
/// consensus; the cameras, with fewer numbers to follow it, lead away from it.
fn fitted(both: &mut [Direction; 2], priors: Priors, start: Cameras, threshold: f64) -> Option<Cameras> {
    const ROUNDS: usize = 6;
    let mut cameras = start;
    for round in 0..ROUNDS {
        let projections = cameras.projections();
        let noise = [both[0].noise(&projections[0])?, both[1].noise(&projections[1])?];
        let points = [&both[0].inliers, &both[1].inliers];
        let tolerance = if round < 2 { COARSE } else { FINE };
        cameras = minimise(&Reprojection { points, noise, priors }, cameras, tolerance, TRIES).0;
        let flags = both[0].agreeing(&cameras.projections()[0], threshold);
        if round >= 2 && flags == both[0].flags {
            break;
        }
        both.iter_mut().for_each(|direction| direction.choose(&flags));
    }
    Some(cameras)
}

/// The best from several focal lengths in diagonals, on some of the inliers.
fn started([forward, reverse]: &[Direction; 2], priors: Priors, focals: &[f64]) -> Option<Cameras> {
    let few = [forward, reverse].map(|direction| direction.inliers.thinned(START_MATCHES));
    let noise = [forward.noise(&forward.free)?, reverse.noise(&reverse.free)?];
    let problem = |scale: f64| Reprojection {
        points: [&few[0], &few[1]],
        noise: noise.map(|n| Noise { point: scale * n.point, depth: scale * n.depth, ..n }),
        priors,
    };
    let mut best: Option<(Cameras, f64)> = None;
    for &focal in focals {
        let Some(start) = Cameras::near([&forward.free, &reverse.free], focal) else { continue };
        // Wide first, as far from the minimum hardly a match would count.
        let (start, _) = minimise(&problem(100.0), start, COARSE, TRIES);
        let (cameras, cost) = minimise(&problem(1.0), start, COARSE, TRIES);
        if best.is_none_or(|(_, least)| cost < least) {
            best = Some((cameras, cost));
        }
    }
    Some(best?.0)
}

/// Both pairs of models under the same noise, which either's inliers show: that of the points by the better of the two, that
/// of the inverse depth by the cameras, as free models hide part of it in H∞.
fn compared(both: &[Direction; 2], cameras: &[Projection; 2]) -> Option<Comparison> {
    const FREE: f64 = 22.0;
    let (mut costs, mut exact) = ([0.0; 2], true);
    for (direction, projection) in both.iter().zip(cameras) {
        let (free, calibrated) = (direction.noise(&direction.free)?, direction.noise(projection)?);
        exact &= calibrated.exact;
        let noise = Noise { point: free.point.min(calibrated.point), ..calibrated };
        costs[0] += direction.cost(&direction.free, &noise);
        costs[1] += direction.cost(projection, &noise);
    }
    // Each match is two coordinates in each direction.
    let price = libm::log(4.0 * both[0].all.len() as f64);
    Some(Comparison {
        free: Score { cost: costs[0], penalty: FREE * price },
        calibrated: Score { cost: costs[1], penalty: Cameras::FREE as f64 * price },
        exact,
    })
}

/// The matches of one direction, from the centres, in diagonals.
struct Direction {
    normalisation: Normalisation,
    all: Points,
    /// Which of them are inliers, and these alone.
    flags: Vec<bool>,
    inliers: Points,
    /// The free model.
    free: Projection,
    /// What the inverse depth at infinity should be, and its standard deviation.
    infinity: [f64; 2],
}

impl Direction {
    fn new(pixels: &Points, inliers: &[bool], [from, to]: [(usize, usize); 2], model: &Model) -> Self {
        let chosen = pixels.select(inliers);
        let normalisation = Normalisation::from_centres(&chosen, from, to);
        let middle = median(chosen.iter().map(|p| p.d).collect()).unwrap_or(0.0);
        let (zero, middle) = (normalisation.depth(0.0), normalisation.depth(middle));
        Self {
            all: normalisation.apply(pixels),
            inliers: normalisation.apply(&chosen),
            flags: inliers.to_vec(),
            free: normalisation.projection(model),
            infinity: [zero, SHIFT * (middle - zero).abs()],
            normalisation,
        }
    }

    /// Which matches are within `threshold` pixels.
    #[inline(never)]
    fn agreeing(&self, p: &Projection, threshold: f64) -> Vec<bool> {
        inliers_of(&self.all, p, threshold * self.normalisation.scale())
    }

    #[inline(never)]
    fn choose(&mut self, flags: &[bool]) {
        self.flags = flags.to_vec();
        self.inliers = self.all.select(flags);
    }

    #[inline(never)]
    fn noise(&self, p: &Projection) -> Option<Noise> {
        let finest = FINEST * self.normalisation.scale();
        Noise::of(&self.inliers, p, finest * finest)
    }

    /// Σ min(error, c²) over all matches.
    fn cost(&self, p: &Projection, noise: &Noise) -> f64 {
        (0..self.all.len()).map(|i| noise.error(&self.all, p, i).min(CAP)).sum()
    }
}
