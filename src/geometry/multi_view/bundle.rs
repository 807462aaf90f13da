//! Bundle adjustment: poses, one focal length, and one inverse depth per landmark, by Levenberg–Marquardt on robust
//! reprojection errors. The landmarks are eliminated (Schur complement); what is left has six unknowns a photo and is solved
//! densely (Triggs et al., *Bundle Adjustment: A Modern Synthesis*, 2000).

use nalgebra::{Matrix2x3, Matrix3, Vector3};

use super::linear::{self, times};
use super::scene::{Camera, Landmark, Scene};
use super::tracks::Observation;
use crate::geometry::calibrated::small_rotation;

/// Where the robust cost goes from square to linear, in standard deviations.
const HUBER: f64 = 1.5;
/// What a landmark costs whose image is behind a camera: as much as one this far off, in pixels.
const BEHIND: f64 = 50.0;
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
/// Returns the robust cost.
pub(super) fn adjust(scene: &mut Scene, root: usize, freedom: Freedom, focal: [f64; 2], iterations: usize) -> f64 {
    let unknowns = Unknowns::of(scene, root, freedom);
    let mut equations = Equations::of(scene, &unknowns, focal);
    let (mut damping, mut growth) = (1e-4, 2.0);
    for _ in 0..iterations {
        let Some(step) = equations.step(damping) else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
            continue;
        };
        let moved = unknowns.moved(scene, &step);
        let next = cost(&moved, focal);
        if next < equations.cost {
            let reduction = equations.cost - next;
            *scene = moved;
            damping = (damping / 3.0).max(1e-10);
            growth = 2.0;
            if reduction <= TOLERANCE * equations.cost {
                equations.cost = next;
                break;
            }
            equations = Equations::of(scene, &unknowns, focal);
        } else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    equations.cost
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

    fn moved(&self, scene: &Scene, step: &Step) -> Scene {
        let mut moved = scene.clone();
        moved.log_focal += step.common[0];
        for (camera, offset) in moved.cameras.iter_mut().zip(&self.offsets) {
            if let (Some(camera), Some(at)) = (camera, *offset) {
                let three = |at: usize| Vector3::new(step.common[at], step.common[at + 1], step.common[at + 2]);
                camera.rotation = times(&small_rotation(three(at)), &camera.rotation);
                if self.per_photo == 6 {
                    camera.translation += three(at + 3);
                }
            }
        }
        for (landmark, step) in moved.landmarks.iter_mut().zip(&step.depths) {
            landmark.depth += step;
        }
        moved
    }
}

/// A step of all unknowns.
struct Step {
    common: Vec<f64>,
    depths: Vec<f64>,
}

/// Huber's cost of a squared error, and its weight; both in standard deviations.
fn huber(square: f64, noise: f64) -> (f64, f64) {
    let square = square / (noise * noise);
    let error = square.sqrt();
    let (cost, weight) =
        if error <= HUBER { (0.5 * square, 1.0) } else { (HUBER * (error - 0.5 * HUBER), HUBER / error) };
    (cost, weight / (noise * noise))
}

fn cost(scene: &Scene, focal: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for landmark in &scene.landmarks {
        let off = (landmark.depth - 1.0) / DEPTH_PRIOR;
        sum += 0.5 * off * off;
        for o in &landmark.seen {
            let square = scene.appearance(landmark, o).map(|a| a.error[0] * a.error[0] + a.error[1] * a.error[1]);
            sum += huber(square.unwrap_or(BEHIND * BEHIND), scene.noise).0;
        }
    }
    let off = (scene.log_focal - focal[0]) / focal[1];
    sum + 0.5 * off * off
}

/// Gauss–Newton: ½ xᵀHx + gᵀx.
struct Equations {
    cost: f64,
    /// Of everything but depth; on the right is the gradient.
    common: linear::Equations,
    depths: Vec<DepthEquation>,
}

/// The part of one landmark's inverse depth.
struct DepthEquation {
    square: f64,
    gradient: f64,
    /// With the other unknowns.
    mixed: Vec<(usize, f64)>,
}

impl Equations {
    fn of(scene: &Scene, unknowns: &Unknowns, focal: [f64; 2]) -> Self {
        let depths = Vec::with_capacity(scene.landmarks.len());
        let mut equations = Self { cost: 0.0, common: linear::Equations::zeros(unknowns.count), depths };
        for landmark in &scene.landmarks {
            equations.add_landmark(scene, unknowns, landmark);
        }
        let (off, weight) = (scene.log_focal - focal[0], 1.0 / (focal[1] * focal[1]));
        equations.cost += 0.5 * weight * off * off;
        equations.common.right[0] += weight * off;
        equations.common.add(0, 0, weight);
        equations
    }

    fn add_landmark(&mut self, scene: &Scene, unknowns: &Unknowns, landmark: &Landmark) {
        let weight = 1.0 / (DEPTH_PRIOR * DEPTH_PRIOR);
        let off = landmark.depth - 1.0;
        self.cost += 0.5 * weight * off * off;
        let mut depth = DepthEquation { square: weight, gradient: weight * off, mixed: Vec::new() };
        for o in &landmark.seen {
            let Some(row) = Row::of(scene, unknowns, landmark, o) else {
                self.cost += huber(BEHIND * BEHIND, scene.noise).0;
                continue;
            };
            let (cost, weight) = huber(row.error[0] * row.error[0] + row.error[1] * row.error[1], scene.noise);
            self.cost += cost;
            for (k, error) in row.error.iter().enumerate() {
                let slopes = &row.slopes[..row.count];
                for (a, (at, slopes_a)) in slopes.iter().enumerate() {
                    let scaled = weight * slopes_a[k];
                    self.common.right[*at] += scaled * error;
                    for (other, slopes_b) in &slopes[..=a] {
                        self.common.add(*at, *other, scaled * slopes_b[k]);
                    }
                }
                depth.square += weight * row.depth[k] * row.depth[k];
                depth.gradient += weight * row.depth[k] * error;
                if unknowns.per_photo == 6 {
                    slopes.iter().for_each(|(at, slopes)| depth.add(*at, weight * slopes[k] * row.depth[k]));
                }
            }
        }
        self.depths.push(depth);
    }

    /// The step of damped normal equations; `None` if they have no solution.
    fn step(&self, damping: f64) -> Option<Step> {
        let mut equations = self.common.clone();
        equations.damp(damping);
        for depth in &self.depths {
            let inverse = 1.0 / (depth.square * (1.0 + damping));
            for (a, (at, value)) in depth.mixed.iter().enumerate() {
                equations.right[*at] -= value * inverse * depth.gradient;
                for (other, second) in &depth.mixed[..=a] {
                    equations.add(*at, *other, -value * inverse * second);
                }
            }
        }
        let mut common = equations.solve()?;
        common.iter_mut().for_each(|v| *v = -*v);
        let of_depth = |depth: &DepthEquation| {
            let mixed: f64 = depth.mixed.iter().map(|(at, value)| value * common[*at]).sum();
            -(depth.gradient + mixed) / (depth.square * (1.0 + damping))
        };
        let depths = self.depths.iter().map(of_depth).collect();
        Some(Step { depths, common })
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
#[inline(never)]
pub(super) fn nearest_rotation(m: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let determinant = m.determinant();
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    crate::geometry::calibrated::nearest_rotation(m / libm::exp(libm::log(determinant) / 3.0))
}
