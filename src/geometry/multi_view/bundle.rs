//! Bundle adjustment: poses, one focal length, ratios to it where photos have their own, one coefficient of distortion, and one inverse
//! depth per landmark, by Levenberg–Marquardt on robust reprojection errors. The landmarks are eliminated (Schur complement); what is left
//! has six or seven unknowns a photo and is solved densely (Triggs et al., *Bundle Adjustment: A Modern Synthesis*, 2000).

use nalgebra::DVector;

use super::baselines::{BASELINE_PRIOR, two_view_pairs};
use super::jacobian::{Slopes, Unknowns};
use super::least_squares::{Equations, cauchy};
use super::pairs::{Motions, PairEquations};
use super::residual::Residual;
use super::scene::{Landmark, Scene};
use crate::geometry::calibrated::small_rotation;
use crate::geometry::levenberg_marquardt::{LeastSquares, Linearised, minimise};

/// How far the inverse depth of a landmark may be from the median, as a multiple of it, before that counts as one standard deviation: only
/// what nothing else determines is affected.
const DEPTH_PRIOR: f64 = 2.0;
/// The standard deviation of the coefficient of distortion, about 0.
const DISTORTION_PRIOR: f64 = 0.15;
/// The standard deviation of the logarithm of a photo's share of the focal length where it is unknown, about that of its first estimate.
const SHARE_PRIOR: f64 = 0.1;
/// Where least squares stop: when a step reduces the cost by less than this fraction. With ten times as much, photos of two sets of exact depth
/// land 4 to 16 px off outside of what two see, instead of 3 to 6.
const TOLERANCE: f64 = 1e-6;
/// Iterations of Newton's method for the scale.
const NEWTON: usize = 6;

/// What may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FreeParameters {
    /// Translations and depth, besides rotations and the focal length.
    pub positions: bool,
    /// The lens' distortion.
    pub distortion: bool,
}

impl FreeParameters {
    /// Of cameras that turn in one place.
    pub const ROTATIONS: Self = Self { positions: false, distortion: false };
    /// Rotations, translations, depth.
    pub const POSES: Self = Self { positions: true, distortion: false };
}

/// Adjusts the scene; the camera of `root` stays. `focal` is mean and standard deviation of the prior of ln(focal length).
pub(super) fn adjust(scene: &mut Scene, root: usize, free: FreeParameters, focal: [f64; 2], iterations: usize) {
    let unknowns = Unknowns::of(scene, root, free);
    let problem = Reprojection::of(scene, &unknowns, focal);
    *scene = minimise(&problem, scene.clone(), TOLERANCE, iterations).0;
}

/// The robust reprojection errors of a scene.
struct Reprojection<'a> {
    unknowns: &'a Unknowns,
    /// The pairs of cameras whose distance has a prior.
    pairs: Vec<[usize; 2]>,
    focal: [f64; 2],
}

impl<'a> Reprojection<'a> {
    fn of(scene: &Scene, unknowns: &'a Unknowns, focal: [f64; 2]) -> Self {
        let pairs = if unknowns.free.positions { two_view_pairs(scene) } else { Vec::new() };
        Self { unknowns, pairs, focal }
    }
}

impl<'a> LeastSquares for Reprojection<'a> {
    type State = Scene;
    type Equations = SceneEquations<'a>;

    fn normal_equations(&self, scene: &Scene) -> SceneEquations<'a> {
        let (unknowns, motions) = (self.unknowns, Motions::of(scene));
        let mut pairs = PairEquations::zeros(&motions);
        let mut equations = SceneEquations {
            unknowns,
            common: Equations::zeros(unknowns.count),
            depths: Vec::with_capacity(scene.landmarks.len()),
            mixed: Vec::with_capacity(scene.landmarks.iter().map(|landmark| landmark.seen.len()).sum()),
            motions,
        };
        for landmark in &scene.landmarks {
            equations.add_landmark(scene, landmark, &mut pairs);
        }
        for pair in &self.pairs {
            equations.add_baseline(scene, *pair, &mut pairs);
        }
        let SceneEquations { common, motions, .. } = &mut equations;
        pairs.add_to(common, unknowns, motions);
        let [mean, deviation] = self.focal;
        common.add_prior(0, libm::log(scene.focal) - mean, deviation);
        if unknowns.free.distortion {
            common.add_prior(1, scene.distortion.0, DISTORTION_PRIOR);
        }
        for (photo, at) in unknowns.shares.iter().enumerate() {
            if let (Some(at), Some(estimate)) = (*at, scene.estimates[photo]) {
                common.add_prior(at, libm::log(scene.shares[photo] / estimate), SHARE_PRIOR);
            }
        }
        equations
    }

    fn moved(&self, scene: &Scene, step: &Step) -> Scene {
        let mut moved = scene.clone();
        moved.focal *= libm::exp(step.common[0]);
        if self.unknowns.free.distortion {
            moved.distortion.0 += step.common[1];
        }
        for (share, at) in moved.shares.iter_mut().zip(&self.unknowns.shares) {
            *share *= at.map_or(1.0, |at| libm::exp(step.common[at]));
        }
        for (camera, offset) in moved.cameras.iter_mut().zip(&self.unknowns.offsets) {
            if let (Some(camera), Some(at)) = (camera, *offset) {
                let three = |at: usize| step.common.fixed_rows::<3>(at).into_owned();
                camera.rotation = small_rotation(three(at)) * camera.rotation;
                if self.unknowns.free.positions {
                    camera.translation += three(at + 3);
                }
            }
        }
        for (landmark, step) in moved.landmarks.iter_mut().zip(&step.depths) {
            landmark.inverse_depth += step;
        }
        if self.unknowns.free.positions {
            moved.scale(best_scale(&moved, &self.pairs));
        }
        moved
    }
}

/// The scale at which a scene costs least. Only the priors of depth and baselines determine it, and steps are straight where that leads along
/// a curve: it would take dozens of them.
fn best_scale(scene: &Scene, pairs: &[[usize; 2]]) -> f64 {
    let depths = scene.landmarks.iter().map(|landmark| landmark.inverse_depth);
    let (sum, squares) = depths.fold((0.0, 0.0), |(sum, squares), d| (sum + d, squares + d * d));
    let baseline = |pair: &[usize; 2]| {
        let [from, to] = pair.map(|photo| scene.cameras[photo]);
        Some(from?.motion_to(&to?).1.norm_squared())
    };
    let baselines = pairs.iter().filter_map(baseline).sum::<f64>()
        * (DEPTH_PRIOR / BASELINE_PRIOR)
        * (DEPTH_PRIOR / BASELINE_PRIOR);
    // Newton's method on the slope of the cost by the inverse of the scale, from the side where it converges.
    let mut inverse = sum / squares;
    for _ in 0..NEWTON {
        let cube = baselines / (inverse * inverse * inverse);
        inverse -= (inverse * squares - sum - cube) / (squares + 3.0 * cube / inverse);
    }
    1.0 / inverse
}

/// A step of all unknowns.
struct Step {
    common: DVector<f64>,
    depths: Vec<f64>,
}

/// The normal equations of a scene.
struct SceneEquations<'a> {
    unknowns: &'a Unknowns,
    motions: Motions,
    /// Of everything but depth.
    common: Equations,
    depths: Vec<DepthEquation>,
    /// Second derivatives by the inverse depth of a landmark and the slopes of a pair, by the pair's index: of all observations.
    mixed: Vec<(usize, Slopes)>,
}

/// The part of one landmark's inverse depth.
struct DepthEquation {
    square: f64,
    gradient: f64,
    /// How many of `mixed` are its own, after those of the landmarks before.
    observations: usize,
}

impl SceneEquations<'_> {
    fn add_landmark(&mut self, scene: &Scene, landmark: &Landmark, pairs: &mut PairEquations) {
        let weight = 1.0 / (DEPTH_PRIOR * DEPTH_PRIOR);
        let off = landmark.inverse_depth - 1.0;
        self.common.cost += 0.5 * weight * off * off;
        let mut depth = DepthEquation { square: weight, gradient: weight * off, observations: 0 };
        for o in landmark.seen.iter() {
            let photos = [landmark.anchor.photo, o.photo];
            let motion = self.motions.between(photos);
            let residual =
                motion.and_then(|motion| Residual::of(scene, motion, [&landmark.anchor, o], landmark.inverse_depth));
            let (cost, weight) = cauchy(residual.as_ref().map(|residual| residual.error), scene.noise);
            self.common.cost += cost;
            let Some(Residual { error, slopes, depth: by_depth }) = residual else { continue };
            let pair = self.motions.index(photos);
            let equations = pairs.of(pair);
            (0..2).for_each(|k| equations.add(&slopes[k], error[k], weight));
            let [x, y] = by_depth.map(|slope| weight * slope);
            depth.square += x * by_depth[0] + y * by_depth[1];
            depth.gradient += x * error[0] + y * error[1];
            if self.unknowns.free.positions {
                self.mixed.push((pair, slopes[0] * x + slopes[1] * y));
                depth.observations += 1;
            }
        }
        self.depths.push(depth);
    }

    fn add_baseline(&mut self, scene: &Scene, photos: [usize; 2], pairs: &mut PairEquations) {
        let (Some(motion), Some(from)) = (self.motions.between(photos), &scene.cameras[photos[0]]) else { return };
        let equations = pairs.of(self.motions.index(photos));
        for (off, slopes) in Residual::of_baseline(motion, from) {
            let weight = 1.0 / (BASELINE_PRIOR * BASELINE_PRIOR);
            self.common.cost += 0.5 * weight * off * off;
            equations.add(&slopes, off, weight);
        }
    }

    /// Every landmark's depth with its part of `mixed`.
    fn depths(&self) -> impl Iterator<Item = (&DepthEquation, &[(usize, Slopes)])> {
        let mut rest = &self.mixed[..];
        self.depths.iter().map(move |depth| {
            let (own, others) = rest.split_at(depth.observations);
            rest = others;
            (depth, own)
        })
    }

    /// Eliminates the depth of every landmark from the equations of the other unknowns.
    fn eliminate(&self, reduced: &mut Equations, damping: f64) {
        let mut pairs = PairEquations::zeros(&self.motions);
        let mut sum = Vec::new();
        for (depth, mixed) in self.depths() {
            let weight = -1.0 / (depth.square * (1.0 + damping));
            // Most landmarks are seen by one camera beside their anchor's.
            if let [(pair, slopes)] = mixed {
                pairs.of(*pair).add(slopes, depth.gradient, weight);
                continue;
            }
            sum.clear();
            for (pair, slopes) in mixed {
                self.motions.row(self.unknowns, *pair, slopes).add_to(&mut sum);
            }
            for (a, (at, value)) in sum.iter().enumerate() {
                let scaled = weight * value;
                reduced.gradient[*at] += scaled * depth.gradient;
                let mut column = reduced.matrix.column_mut(*at);
                sum[a..].iter().for_each(|(other, second)| column[*other] += scaled * second);
            }
        }
        pairs.add_to(reduced, self.unknowns, &self.motions);
    }
}

impl Linearised for SceneEquations<'_> {
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
        self.eliminate(&mut reduced, damping);
        let common = reduced.solve()?;
        let changes = self.motions.changes(self.unknowns, &common);
        let of_depth = |(depth, mixed): (&DepthEquation, &[(usize, Slopes)])| {
            let mixed: f64 = mixed.iter().map(|(pair, slopes)| slopes.dot(&changes[*pair])).sum();
            -(depth.gradient + mixed) / (depth.square * (1.0 + damping))
        };
        let depths: Vec<f64> = self.depths().map(of_depth).collect();
        let mut predicted = common.dot(&(common.component_mul(&amounts) - &self.common.gradient));
        for (depth, step) in self.depths.iter().zip(&depths) {
            predicted += step * (damping * depth.square * step - depth.gradient);
        }
        Some((Step { depths, common }, 0.5 * predicted))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use std::sync::Arc;

    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::Distortion;
    use crate::geometry::multi_view::Lens;
    use crate::geometry::multi_view::scene::Camera;
    use crate::geometry::multi_view::self_calibration::Focal;
    use crate::geometry::multi_view::tracks::Observation;

    /// Three cameras, and landmarks that they see some pixels from where they are.
    fn scene() -> Scene {
        let lenses = [Lens { size: (800, 600), focal: None }; 3];
        let focal = Focal {
            shares: vec![1.0, 1.1, 0.9],
            estimates: vec![Some(1.0), None, Some(1.0)],
            value: 0.9,
            prior: [-0.35, 0.35],
        };
        let mut scene = Scene::new(&lenses, &focal);
        scene.distortion = Distortion(-0.2);
        for (i, camera) in scene.cameras.iter_mut().enumerate() {
            let i = i as f64;
            let rotation = small_rotation(Vector3::new(0.02 * i, -0.05 * i, 0.03));
            *camera = Some(Camera { rotation, translation: Vector3::new(0.1 * i + 0.02, 0.03, -0.02 * i) });
        }
        for i in 0..9 {
            let at = |photo, place| Observation { photo, place };
            let (first, offset) = (i % 2, f64::from(i as u8 % 5) - 2.0);
            let anchor = at(first, [0.07 * i as f64 - 0.3, 0.2 - 0.05 * i as f64]);
            let landmark = Landmark { anchor, inverse_depth: 0.4 + 0.2 * i as f64, seen: Arc::default() };
            let seen = (first + 1..3).map(|photo| {
                let exact = scene.appearance(&landmark, &at(photo, [0.0; 2])).unwrap().error;
                at(photo, exact.map(|p| p / 1000.0 + 0.001 * offset))
            });
            scene.landmarks.push(Landmark { seen: seen.collect(), ..landmark });
        }
        scene
    }

    /// The same with landmarks that two cameras see, and no third.
    fn scene_of_pairs() -> Scene {
        let mut scene = scene();
        let pairs = scene.landmarks.iter().flat_map(|landmark| {
            landmark.seen.iter().map(move |o| Landmark { seen: Arc::new([*o]), ..landmark.clone() })
        });
        let pairs: Vec<Landmark> = pairs.collect();
        scene.landmarks = [&pairs[..], &pairs[..]].concat();
        assert_eq!(two_view_pairs(&scene), [[0, 1], [0, 2], [1, 2]]);
        scene
    }

    #[test]
    fn gradients_are_those_of_the_cost_and_steps_leave_the_best_scale() {
        let freedoms = [(false, false), (true, false), (false, true), (true, true)];
        for (start, (positions, distortion)) in
            [scene(), scene_of_pairs()].iter().flat_map(|s| freedoms.map(|f| (s, f)))
        {
            let (free, landmarks) = (FreeParameters { positions, distortion }, start.landmarks.len());
            let unknowns = Unknowns::of(start, 0, free);
            let problem = Reprojection::of(start, &unknowns, [-0.35, 0.35]);
            let none = || Step { common: DVector::zeros(problem.unknowns.count), depths: vec![0.0; landmarks] };
            let start = problem.moved(start, &none());
            if positions {
                let cost = |scale: f64| {
                    let mut scaled = start.clone();
                    scaled.scale(scale);
                    problem.normal_equations(&scaled).cost()
                };
                let off = (cost(1.0 + 1e-5) - cost(1.0 - 1e-5)) / 2e-5;
                assert!(off.abs() < 1e-6, "{off}");
            }
            let equations = problem.normal_equations(&start);
            let slope = |set: &dyn Fn(&mut Step, f64)| {
                let cost = |by: f64| {
                    let mut step = none();
                    set(&mut step, by);
                    problem.normal_equations(&problem.moved(&start, &step)).cost()
                };
                (cost(1e-6) - cost(-1e-6)) / 2e-6
            };
            let common = (0..problem.unknowns.count)
                .map(|i| (equations.common.gradient[i], slope(&|step: &mut Step, by| step.common[i] = by)));
            let depths = (0..landmarks)
                .map(|i| (equations.depths[i].gradient, slope(&|step: &mut Step, by| step.depths[i] = by)));
            for (i, (gradient, slope)) in common.chain(depths).enumerate() {
                assert!((gradient - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{free:?} {i}: {gradient} {slope}");
            }
        }
    }
}
