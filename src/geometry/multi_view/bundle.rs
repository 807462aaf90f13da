//! Bundle adjustment: poses, one focal length, and one inverse depth per landmark, by Levenberg–Marquardt on robust
//! reprojection errors. The landmarks are eliminated (Schur complement); what is left has six unknowns a photo and is solved
//! densely (Triggs et al., *Bundle Adjustment: A Modern Synthesis*, 2000).

use nalgebra::{DVector, Matrix2x3, Matrix3, Vector3};

use super::least_squares::{Equations, cauchy};
use super::scene::{Camera, Landmark, Scene};
use super::tracks::Observation;
use crate::geometry::calibrated::small_rotation;
use crate::geometry::levenberg_marquardt::{LeastSquares, Linearised, minimise};

/// How far the inverse depth of a landmark may be from the median, as a multiple of it, before that counts as one standard deviation: only
/// what nothing else determines is affected.
const DEPTH_PRIOR: f64 = 2.0;
/// Where least squares stop: when a step reduces the cost by less than this fraction.
const TOLERANCE: f64 = 1e-6;

/// What may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Freedom {
    /// Cameras that turn in one place.
    Rotations,
    /// Rotations, translations, depth.
    Poses,
}

/// Adjusts the scene; the camera of `root` stays. `focal` is mean and standard deviation of the prior of ln(focal length).
pub(super) fn adjust(scene: &mut Scene, root: usize, freedom: Freedom, focal: [f64; 2], iterations: usize) {
    let problem = Reprojection { unknowns: Unknowns::of(scene, root, freedom), focal };
    *scene = minimise(&problem, scene.clone(), TOLERANCE, iterations).0;
}

/// The robust reprojection errors of a scene.
struct Reprojection {
    unknowns: Unknowns,
    focal: [f64; 2],
}

impl LeastSquares for Reprojection {
    type State = Scene;
    type Equations = SceneEquations;

    fn normal_equations(&self, scene: &Scene) -> SceneEquations {
        let depths = Vec::with_capacity(scene.landmarks.len());
        let mut equations = SceneEquations { common: Equations::zeros(self.unknowns.count), depths };
        for landmark in &scene.landmarks {
            equations.add_landmark(scene, &self.unknowns, landmark);
        }
        let (mean, deviation) = (self.focal[0], self.focal[1]);
        let (off, weight) = (scene.log_focal - mean, 1.0 / (deviation * deviation));
        equations.common.cost += 0.5 * weight * off * off;
        equations.common.gradient[0] += weight * off;
        equations.common.add(0, 0, weight);
        equations
    }

    fn moved(&self, scene: &Scene, step: &Step) -> Scene {
        let mut moved = scene.clone();
        moved.log_focal += step.common[0];
        for (camera, offset) in moved.cameras.iter_mut().zip(&self.unknowns.offsets) {
            if let (Some(camera), Some(at)) = (camera, *offset) {
                let three = |at: usize| step.common.fixed_rows::<3>(at).into_owned();
                camera.rotation = small_rotation(three(at)) * camera.rotation;
                if self.unknowns.per_photo == 6 {
                    camera.translation += three(at + 3);
                }
            }
        }
        for (landmark, step) in moved.landmarks.iter_mut().zip(&step.depths) {
            landmark.depth += step;
        }
        if self.unknowns.per_photo == 6 {
            // Only the prior of depth determines the scale, and steps are straight where that leads along a curve: it would take dozens
            // of them. The best scale is known.
            let depths = moved.landmarks.iter().map(|landmark| landmark.depth);
            let (sum, squares) = depths.fold((0.0, 0.0), |(sum, squares), d| (sum + d, squares + d * d));
            moved.scale(squares / sum);
        }
        moved
    }
}

/// Which unknown is where.
struct Unknowns {
    /// The first one of each photo; `None` where nothing may change.
    offsets: Vec<Option<usize>>,
    per_photo: usize,
    count: usize,
}

impl Unknowns {
    fn of(scene: &Scene, root: usize, freedom: Freedom) -> Self {
        let per_photo = if freedom == Freedom::Poses { 6 } else { 3 };
        let mut count = 1;
        let place = |(photo, camera): (usize, &Option<Camera>)| {
            (camera.is_some() && photo != root).then(|| {
                count += per_photo;
                count - per_photo
            })
        };
        let offsets = scene.cameras.iter().enumerate().map(place).collect();
        Self { offsets, per_photo, count }
    }
}

/// A step of all unknowns.
struct Step {
    common: DVector<f64>,
    depths: Vec<f64>,
}

/// The normal equations of a scene.
struct SceneEquations {
    /// Of everything but depth.
    common: Equations,
    depths: Vec<DepthEquation>,
}

/// The part of one landmark's inverse depth.
struct DepthEquation {
    square: f64,
    gradient: f64,
    /// With the other unknowns.
    mixed: Vec<(usize, f64)>,
}

impl SceneEquations {
    fn add_landmark(&mut self, scene: &Scene, unknowns: &Unknowns, landmark: &Landmark) {
        let weight = 1.0 / (DEPTH_PRIOR * DEPTH_PRIOR);
        let off = landmark.depth - 1.0;
        self.common.cost += 0.5 * weight * off * off;
        let mut depth = DepthEquation { square: weight, gradient: weight * off, mixed: Vec::new() };
        for o in &landmark.seen {
            let row = Row::of(scene, unknowns, landmark, o);
            let (cost, weight) = cauchy(row.as_ref().map(|row| row.error), scene.noise);
            self.common.cost += cost;
            let Some(row) = row else { continue };
            let slopes = &row.slopes[..row.count];
            self.common.add_residual(slopes, row.error, weight);
            for (k, error) in row.error.iter().enumerate() {
                let scaled = weight * row.depth[k];
                depth.square += scaled * row.depth[k];
                depth.gradient += scaled * error;
                if unknowns.per_photo == 6 {
                    slopes.iter().for_each(|(at, slopes)| depth.add(*at, scaled * slopes[k]));
                }
            }
        }
        self.depths.push(depth);
    }
}

impl Linearised for SceneEquations {
    type Step = Step;

    fn cost(&self) -> f64 {
        self.common.cost
    }

    fn initial_damping(&self) -> f64 {
        self.common.initial_damping()
    }

    fn step(&self, damping: f64) -> Option<(Step, f64)> {
        let mut reduced = self.common.clone();
        let amounts = reduced.damp(damping);
        for depth in &self.depths {
            let inverse = 1.0 / (depth.square * (1.0 + damping));
            for (a, (at, value)) in depth.mixed.iter().enumerate() {
                reduced.gradient[*at] -= value * inverse * depth.gradient;
                for (other, second) in &depth.mixed[..=a] {
                    reduced.add(*at, *other, -value * inverse * second);
                }
            }
        }
        let common = reduced.solve()?;
        let of_depth = |depth: &DepthEquation| {
            let mixed: f64 = depth.mixed.iter().map(|(at, value)| value * common[*at]).sum();
            -(depth.gradient + mixed) / (depth.square * (1.0 + damping))
        };
        let depths: Vec<f64> = self.depths.iter().map(of_depth).collect();
        let mut predicted = common.dot(&(common.component_mul(&amounts) - &self.common.gradient));
        for (depth, step) in self.depths.iter().zip(&depths) {
            predicted += step * (damping * depth.square * step - depth.gradient);
        }
        Some((Step { depths, common }, 0.5 * predicted))
    }
}

impl DepthEquation {
    /// Adds to what belongs to one unknown; they are in ascending order.
    fn add(&mut self, at: usize, value: f64) {
        let after = self.mixed.iter().position(|(other, _)| *other >= at).unwrap_or(self.mixed.len());
        match self.mixed.get_mut(after) {
            Some((other, sum)) if *other == at => *sum += value,
            _ => self.mixed.insert(after, (at, value)),
        }
    }
}

/// The derivatives of one observation's error.
struct Row {
    error: [f64; 2],
    /// Unknown, and the slopes of both coordinates.
    slopes: [(usize, [f64; 2]); 13],
    count: usize,
    depth: [f64; 2],
}

impl Row {
    fn of(scene: &Scene, unknowns: &Unknowns, landmark: &Landmark, o: &Observation) -> Option<Self> {
        let from = scene.cameras[landmark.anchor.photo].as_ref()?;
        let to = scene.cameras[o.photo].as_ref()?;
        let ((rotation, t), w) = (from.motion_to(to), landmark.depth);
        let ray = scene.ray(&landmark.anchor);
        let seen = scene.error(rotation * ray + t * w, o)?;
        let p = seen.point;
        let scale = scene.diagonals[o.photo] * scene.focal(o.photo) / p[2];
        let slope = Matrix2x3::new(1.0, 0.0, -p[0] / p[2], 0.0, 1.0, -p[1] / p[2]) * scale;
        let mut row = Self { error: seen.error, slopes: [(0, [0.0; 2]); 13], count: 0, depth: [0.0; 2] };
        let depth = slope * t;
        row.depth = [depth[0], depth[1]];
        let mut put = |at: usize, x: f64, y: f64| {
            row.slopes[row.count] = (at, [x, y]);
            row.count += 1;
        };
        // A longer lens enlarges this photo, and straightens the rays of the other.
        let bent = slope * (rotation * Vector3::new(-ray[0], -ray[1], 0.0));
        put(0, bent[0] + scale * p[0], bent[1] + scale * p[1]);
        // ω × v = −[v]× ω; R_to Rᵀ_from exp(−ω) c moves by R [c]× ω.
        let turned = |v: Vector3<f64>| -(slope * v.cross_matrix());
        let of_anchor = slope * rotation * (ray - from.translation * w).cross_matrix();
        let shift = slope * w;
        let ends =
            [(o.photo, turned(p - to.translation * w), shift), (landmark.anchor.photo, of_anchor, -(shift * rotation))];
        for (photo, turn, shift) in ends {
            if let Some(at) = unknowns.offsets[photo] {
                (0..3).for_each(|k| put(at + k, turn[(0, k)], turn[(1, k)]));
                if unknowns.per_photo == 6 {
                    (0..3).for_each(|k| put(at + 3 + k, shift[(0, k)], shift[(1, k)]));
                }
            }
        }
        Some(row)
    }
}

/// The rotation that is nearest to a matrix with a positive determinant.
pub(super) fn nearest_rotation(m: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let determinant = m.determinant();
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    crate::geometry::calibrated::nearest_rotation(m / libm::exp(libm::log(determinant) / 3.0))
}
