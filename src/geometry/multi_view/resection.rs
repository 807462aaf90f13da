//! Where a camera stands whose rotation is about known, from landmarks that others have placed.

use nalgebra::{Matrix2x3, Matrix3, SVector, Vector3};

use super::scene::{Camera, Scene};
use super::tracks::Observation;
use crate::geometry::calibrated::small_rotation;
use crate::geometry::levenberg_marquardt::{LeastSquares, NormalEquations, minimise};
use crate::sampler::Sampler;

/// Samples of two landmarks; a sample without an outlier is the rule, not the exception.
const TRIALS: usize = 200;
/// The tolerance of that search in pixels, as the rotation is not exact, and that of what counts in the end.
const SEARCH: f64 = 12.0;
pub(super) const TOLERANCE: f64 = 4.0;
/// Residuals up to this count squared, in pixels; beyond they lose weight (Cauchy).
const SCALE: f64 = 2.0;

/// A landmark in the world's axes, (X, w), and where the new camera sees it.
pub(super) struct LandmarkObservation {
    point: Vector3<f64>,
    inverse_depth: f64,
    observation: Observation,
}

impl LandmarkObservation {
    pub fn new(scene: &Scene, anchor: &Observation, depth: f64, observation: Observation) -> Option<Self> {
        let camera = scene.cameras[anchor.photo].as_ref()?;
        let point = camera.rotation.tr_mul(&(scene.ray(anchor) - camera.translation * depth));
        Some(Self { point, inverse_depth: depth, observation })
    }

    fn seen_by(&self, camera: &Camera) -> Vector3<f64> {
        camera.rotation * self.point + camera.translation * self.inverse_depth
    }

    /// The error in pixels.
    pub fn error(&self, scene: &Scene, camera: &Camera) -> f64 {
        let found = scene.error(self.seen_by(camera), &self.observation);
        found.map_or(f64::INFINITY, |found| found.distance())
    }
}

/// The camera of this rotation, nearly, that sees most of the landmarks where they were seen; and how many.
pub(super) fn resect(
    scene: &Scene,
    rotation: &Matrix3<f64>,
    observations: &[LandmarkObservation],
    sampler: &mut Sampler,
) -> Option<(Camera, usize)> {
    if observations.len() < 3 {
        return None;
    }
    let mut best: Option<(Camera, f64)> = None;
    for _ in 0..TRIALS {
        let mut pick = [0; 2];
        sampler.sample(observations.len(), &mut pick);
        let Some(translation) = translation(scene, rotation, pick.map(|i| &observations[i])) else { continue };
        let camera = Camera { rotation: *rotation, translation };
        let cost = observations.iter().map(|s| (s.error(scene, &camera) / SEARCH).powi(2).min(1.0)).sum();
        if best.is_none_or(|(_, least)| cost < least) {
            best = Some((camera, cost));
        }
    }
    let problem = Resection { scene, observations };
    let (camera, _) = minimise(&problem, best?.0, 1e-6, 60);
    let close = observations.iter().filter(|s| s.error(scene, &camera) < TOLERANCE).count();
    Some((camera, close))
}

/// The translation for which two landmarks are nearest to their rays: x × (R X + w t) = 0.
fn translation(scene: &Scene, rotation: &Matrix3<f64>, two: [&LandmarkObservation; 2]) -> Option<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for observation in two {
        let cross = scene.ray(&observation.observation).cross_matrix();
        let a = cross * observation.inverse_depth;
        matrix += a.tr_mul(&a);
        right -= a.tr_mul(&(cross * (rotation * observation.point)));
    }
    let found = matrix.cholesky()?.solve(&right);
    found.iter().all(|v| v.is_finite()).then_some(found)
}

/// Robust reprojection errors of one camera.
struct Resection<'a> {
    scene: &'a Scene,
    observations: &'a [LandmarkObservation],
}

impl LeastSquares for Resection<'_> {
    type State = Camera;
    type Equations = NormalEquations<6>;

    fn normal_equations(&self, camera: &Camera) -> NormalEquations<6> {
        let mut equations = NormalEquations::zeros();
        for observation in self.observations {
            let o = &observation.observation;
            let Some(seen) = self.scene.error(observation.seen_by(camera), o) else {
                equations.cost += SCALE * SCALE * 5.0;
                continue;
            };
            let p = seen.point;
            let square = (seen.error[0].powi(2) + seen.error[1].powi(2)) / (SCALE * SCALE);
            equations.cost += 0.5 * SCALE * SCALE * libm::log1p(square);
            let weight = 1.0 / (1.0 + square);
            let scale = self.scene.diagonals[o.photo] * self.scene.focal(o.photo) / p[2];
            let slope = Matrix2x3::new(1.0, 0.0, -p[0] / p[2], 0.0, 1.0, -p[1] / p[2]) * scale;
            let turn = -(slope * (p - camera.translation * observation.inverse_depth).cross_matrix());
            let shift = slope * observation.inverse_depth;
            for k in 0..2 {
                let row = SVector::<f64, 6>::from_fn(|i, _| if i < 3 { turn[(k, i)] } else { shift[(k, i - 3)] });
                equations.add(&row, seen.error[k], weight);
            }
        }
        equations
    }

    fn moved(&self, camera: &Camera, step: &SVector<f64, 6>) -> Camera {
        Camera {
            rotation: small_rotation(step.fixed_rows::<3>(0).into_owned()) * camera.rotation,
            translation: camera.translation + step.fixed_rows::<3>(3),
        }
    }
}
