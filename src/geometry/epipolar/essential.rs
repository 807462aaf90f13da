//! The essential matrix: rotation and direction of translation between two calibrated cameras.

use nalgebra::{Matrix3, SVector, Vector3};

use super::fundamental::cofactors;
use super::refine::sampson_distance;
use crate::geometry::calibrated::{nearest_rotation, small_rotation};
use crate::geometry::eigen::eigenpairs;
use crate::geometry::levenberg_marquardt::{LeastSquares, NormalEquations, minimise};

/// Where least squares stop: when a step reduces the cost by less than this fraction, or after so many iterations.
const TOLERANCE: f64 = 1e-6;
const ITERATIONS: usize = 30;
/// Multiples of the noise, one after another.
const NOISE_RATIOS: [f64; 2] = [16.0, 1.0];

/// R and t.
pub(in crate::geometry) type Motion = (Matrix3<f64>, Vector3<f64>);
/// Rays of both photos, third coordinates 1.
pub(in crate::geometry) type Rays = [Vector3<f64>; 2];

/// The four motions of an essential matrix (B. Horn, *Recovering Baseline and Orientation from Essential Matrix*, 1990).
pub(in crate::geometry) fn decompose(essential: &Matrix3<f64>) -> Option<Vec<Motion>> {
    // t is what E has no share of; with E = [t]× R the cofactors of E are (t·t) R + [t]× E, [t]× squared being ttᵀ − t·t.
    let [.., (_, direction)] = eigenpairs(&(*essential * essential.transpose()))?;
    let scale = essential.norm() / std::f64::consts::SQRT_2;
    let essential = essential / scale;
    let cofactors = cofactors(&essential);
    let mut found = Vec::new();
    for t in [direction, -direction] {
        let rotation = nearest_rotation(cofactors - (t.cross_matrix() * essential))?;
        found.push((rotation, direction));
        found.push((rotation, -direction));
    }
    Some(found)
}

/// The motion that has most of the matches in front of both cameras; the first of several.
pub(in crate::geometry) fn in_front(rays: &[Rays], candidates: &[Motion]) -> Option<Motion> {
    let count = |(rotation, t): &Motion| {
        let ahead = |[from, to]: &&Rays| {
            // z' x' = z R x + t: cross products with x' and with R x leave either depth.
            let far = rotation * from;
            let across = to.cross(&far);
            across.dot(&t.cross(to)) > 0.0 && across.dot(&t.cross(&far)) > 0.0
        };
        rays.iter().filter(ahead).count()
    };
    let mut best: Option<(usize, &Motion)> = None;
    for candidate in candidates {
        let found = count(candidate);
        // A homography's motions differ little in this: by a tenth at least.
        if best.is_none_or(|(most, _)| found > most + most / 10) {
            best = Some((found, candidate));
        }
    }
    best.map(|(_, found)| *found)
}

/// How a camera moved, and its focal length.
#[derive(Debug, Clone, Copy)]
pub(super) struct MotionAndFocal {
    pub motion: Motion,
    /// ln of the focal length, in units of that which the rays were made with.
    log_focal: f64,
}

impl MotionAndFocal {
    /// E = [t]× R.
    pub fn essential(&self) -> Matrix3<f64> {
        let (rotation, t) = &self.motion;
        t.cross_matrix() * rotation
    }

    /// The rays of a match with this focal length.
    pub fn rays(&self, rays: &Rays) -> Rays {
        let scale = libm::exp(-self.log_focal);
        rays.map(|ray| Vector3::new(scale * ray[0], scale * ray[1], 1.0))
    }
}

/// Robust Sampson distances of matches, in units of `noise`, and a prior of the focal length.
struct SampsonDistances<'a> {
    rays: &'a [Rays],
    noise: f64,
    /// Standard deviation of ln f, about 0.
    deviation: f64,
}

impl LeastSquares for SampsonDistances<'_> {
    type State = MotionAndFocal;
    /// Rotation, translation and ln f; two more unknowns that nothing depends on, as those of the fundamental matrix are solved already.
    type Equations = NormalEquations<9>;

    fn normal_equations(&self, cameras: &MotionAndFocal) -> NormalEquations<9> {
        let ((rotation, t), essential) = (&cameras.motion, cameras.essential());
        let (cross, unit) = (t.cross_matrix(), libm::exp(cameras.log_focal) / self.noise);
        let mut equations = NormalEquations::zeros();
        for rays in self.rays {
            let [x, u] = cameras.rays(rays);
            let (distance, derivative) = sampson_distance(&essential, &x, &u);
            let r = distance * unit;
            // √(1 + r²) − 1: quadratic at first, then linear.
            let root = (1.0 + r * r).sqrt();
            equations.cost += root - 1.0;
            // E changes by [δ]×R, and by [t]×[ω]×R.
            let by_translation = derivative * rotation.transpose();
            let by_rotation = axial(&cross.tr_mul(&by_translation));
            let by_translation = axial(&by_translation);
            // By ln f it grows in its third row and its third column, but for a factor.
            let by_focal = derivative.row(2).dot(&essential.row(2)) + derivative.column(2).dot(&essential.column(2));
            let derivatives =
                by_rotation.into_iter().chain(by_translation).chain([by_focal, 0.0, 0.0]).map(|by| unit * by);
            equations.add(&SVector::from_iterator(derivatives), r, 1.0 / root);
        }
        let weight = 1.0 / (self.deviation * self.deviation);
        equations.cost += 0.5 * weight * cameras.log_focal * cameras.log_focal;
        equations.gradient[6] += weight * cameras.log_focal;
        equations.matrix[(6, 6)] += weight;
        equations
    }

    fn moved(
        &self,
        MotionAndFocal { motion: (rotation, t), log_focal }: &MotionAndFocal,
        step: &SVector<f64, 9>,
    ) -> MotionAndFocal {
        let turn = small_rotation(step.fixed_rows::<3>(0).into_owned());
        let motion = (turn * rotation, (t + step.fixed_rows::<3>(3)).normalize());
        MotionAndFocal { motion, log_focal: log_focal + step[6] }
    }
}

/// The vector a with a·δ = M : [δ]× for all δ.
fn axial(m: &Matrix3<f64>) -> [f64; 3] {
    [m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]]
}

/// Minimises the robust Sampson distances of the rays from `start`: the cameras found, and the cost. `noise` is the distance from which on a
/// match counts less, a larger one at first, as few matches have any influence far from the minimum; `deviation` is the standard deviation of
/// the logarithm of the focal length.
pub(super) fn refine_cameras(rays: &[Rays], start: Motion, noise: f64, deviation: f64) -> (MotionAndFocal, f64) {
    let start = MotionAndFocal { motion: start, log_focal: 0.0 };
    NOISE_RATIOS.iter().fold((start, f64::INFINITY), |(cameras, _), ratio| {
        minimise(&SampsonDistances { rays, noise: ratio * noise, deviation }, cameras, TOLERANCE, ITERATIONS)
    })
}
