//! The reprojection error of two cameras if the inverse depth is inaccurate as well as the points.
//!
//! A depth from a single photo is far less accurate than a match, and its error moves a point along its epipolar line only.
//! So each match gets the correction δ of its inverse depth that suits it best: with variance σ² of the points' coordinates
//! and τ² of the inverse depth, its squared error is min over δ of |r(d + δ)|²/σ² + δ²/τ². The distance across the line
//! counts in full; the distance along it as far as the depth is reliable.

use nalgebra::{SVector, Vector2, Vector3};

use super::cameras::{Cameras, PARAMETERS};
use crate::geometry::correspondences::{Correspondence, Correspondences, ProjectionMatrix, transform};
use crate::geometry::levenberg_marquardt::{LeastSquares, NormalEquations};
use crate::geometry::model::depth_derivative;
use crate::statistics::{CHI_SQUARED_MEDIAN, median};

/// c² of the robust cost x/(1 + x/c²) of a squared error x (Geman & McClure 1987): from three standard deviations on, the
/// influence of a match decreases.
pub(super) const CAP: f64 = 9.0;

/// The inverse depth counts as exact while its variance is less than so many times what the points' variance alone amounts
/// to. Tuned on the evaluation cases with rendered and with estimated depth.
const EXACT: f64 = 4.0;

/// How far a correction may move a point towards the camera, as a fraction of its distance.
const MAX_APPROACH: f64 = 0.9;

/// Variances of one direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Of a point's coordinate.
    pub point: f64,
    /// Of the inverse depth.
    pub depth: f64,
    /// Whether the inverse depth is about as accurate as the points.
    pub exact: bool,
}

impl Noise {
    /// From the errors across and along the epipolar lines; `min` is the least variance of a point. `None` without points or
    /// without parallax.
    pub fn estimate(points: &Correspondences, p: &ProjectionMatrix, min: f64) -> Option<Self> {
        let (mut across, mut along, mut units) = (Vec::new(), Vec::new(), Vec::new());
        let e = p.column(3).into_owned();
        for point in points.iter() {
            let image = Projected::new(transform(p, point.x, point.y, point.d).into());
            let (r, slope) = (image.residual(point), Vector2::from(depth_derivative(&e, image.place, image.third)));
            let square = slope.norm_squared();
            across.push(r.perp(&slope) * r.perp(&slope) / square);
            along.push(r.dot(&slope) * r.dot(&slope) / (square * square));
            units.push(1.0 / square);
        }
        let point = (median(across)? / CHI_SQUARED_MEDIAN).max(min);
        // The part of the depth's variance that the points' own errors cause.
        let part = point * median(units)?;
        let depth = (median(along)? / CHI_SQUARED_MEDIAN - part).max(0.01 * part);
        (point + depth).is_finite().then_some(Self { point, depth, exact: depth < EXACT * part })
    }

    /// The squared error of a match, in standard deviations; infinite behind the camera.
    pub fn squared_error(&self, point: &Correspondence, p: &ProjectionMatrix) -> f64 {
        let image = Vector3::from(transform(p, point.x, point.y, point.d));
        let e = p.column(3).into_owned();
        if image[2] > 0.0 { Corrected::new(point, image, e, self).squared_error } else { f64::INFINITY }
    }
}

/// The image of a point.
struct Projected {
    /// The third coordinate. That of a point which a step moves behind the camera is small and positive: it is projected far
    /// away, so that the step is rejected.
    third: f64,
    place: [f64; 2],
}

impl Projected {
    fn new(image: Vector3<f64>) -> Self {
        let third = image[2].max(1e-9);
        Self { third, place: [image[0] / third, image[1] / third] }
    }

    fn residual(&self, point: &Correspondence) -> Vector2<f64> {
        Vector2::new(self.place[0] - point.u, self.place[1] - point.v)
    }
}

/// One match with its inverse depth corrected.
struct Corrected {
    /// δ.
    correction: f64,
    /// In standard deviations.
    squared_error: f64,
    /// Along the epipolar line and across it: the derivative of the coordinate by the homogeneous image,
    gradients: [Vector3<f64>; 2],
    /// the coordinate,
    coordinates: [f64; 2],
    /// its residual,
    residuals: [f64; 2],
    /// and what remains of the residual's derivatives as δ follows.
    factors: [f64; 2],
}

impl Corrected {
    /// Of a match with the homogeneous `image`, which moves by `e` per inverse depth.
    fn new(point: &Correspondence, image: Vector3<f64>, e: Vector3<f64>, noise: &Noise) -> Self {
        let ratio = noise.point / noise.depth;
        // With the derivative at the observed point, over the third coordinate at d, r(d + δ) is linear in δ.
        let projected = Projected::new(image);
        let slope = Vector2::from(depth_derivative(&e, [point.u, point.v], projected.third));
        let step = -projected.residual(point).dot(&slope) / (slope.norm_squared() + ratio);
        // It must not move the point through the camera.
        let approach = -step * e[2] / projected.third;
        let correction = if approach > MAX_APPROACH { step * MAX_APPROACH / approach } else { step };
        let projected = Projected::new(image + e * correction);
        let slope = Vector2::from(depth_derivative(&e, projected.place, projected.third));
        let (residual, square) = (projected.residual(point), slope.norm_squared());
        let along = slope / square.sqrt().max(1e-300);
        let directions = [along, Vector2::new(-along[1], along[0])];
        let coordinates = directions.map(|direction| direction.dot(&Vector2::from(projected.place)));
        Self {
            correction,
            squared_error: residual.norm_squared() / noise.point + correction * correction / noise.depth,
            gradients: [0, 1]
                .map(|k| Vector3::new(directions[k][0], directions[k][1], -coordinates[k]) / projected.third),
            coordinates,
            residuals: directions.map(|direction| direction.dot(&residual)),
            factors: [ratio / (square + ratio), 1.0],
        }
    }

    /// Adds the match to the equations; `derivatives` are those of both coordinates by the parameters.
    fn add(&self, equations: &mut NormalEquations<PARAMETERS>, noise: &Noise, derivatives: [Derivatives; 2]) {
        let robust = 1.0 / (1.0 + self.squared_error / CAP);
        equations.cost += 0.5 * self.squared_error * robust;
        let weight = robust * robust / noise.point;
        for (k, row) in derivatives.iter().enumerate() {
            // The gradient follows from the residual itself: δ minimises the error, so its change does not count.
            equations.gradient.axpy(weight * self.residuals[k], row, 1.0);
            equations.matrix.syger(weight * self.factors[k], row, row, 1.0);
        }
    }
}

/// The derivatives of a coordinate by the parameters of [`Cameras`].
type Derivatives = SVector<f64, PARAMETERS>;

/// What is expected of parameters before any match is considered: means with standard deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Priors {
    pub log_focal: [f64; 2],
    pub shift: [[f64; 2]; 2],
}

/// Robust errors in both directions, target to reference first, and the priors.
pub(super) struct Reprojection<'a> {
    pub points: [&'a Correspondences; 2],
    pub noise: [Noise; 2],
    pub priors: Priors,
}

impl LeastSquares for Reprojection<'_> {
    type State = Cameras;
    type Equations = NormalEquations<PARAMETERS>;

    fn normal_equations(&self, cameras: &Cameras) -> NormalEquations<PARAMETERS> {
        let mut equations = NormalEquations::zeros();
        self.add_forward(cameras, &mut equations);
        self.add_reverse(cameras, &mut equations);
        let priors = [
            (6, cameras.log_focal, self.priors.log_focal),
            (7, cameras.shift[0], self.priors.shift[0]),
            (9, cameras.shift[1], self.priors.shift[1]),
        ];
        for (i, value, [mean, deviation]) in priors {
            let (off, weight) = (value - mean, 1.0 / (deviation * deviation));
            equations.cost += 0.5 * weight * off * off;
            equations.gradient[i] += weight * off;
            equations.matrix[(i, i)] += weight;
        }
        equations
    }

    fn moved(&self, cameras: &Cameras, step: &Derivatives) -> Cameras {
        cameras.moved(step)
    }
}

impl Reprojection<'_> {
    fn add_forward(&self, cameras: &Cameras, equations: &mut NormalEquations<PARAMETERS>) {
        let (noise, f) = (&self.noise[0], cameras.focal());
        let (r, t) = (&cameras.rotation, cameras.translation);
        let axis = r.column(2) * f;
        for point in self.points[0].iter() {
            let ray = r * Vector3::new(point.x, point.y, f);
            let depth = point.d - cameras.shift[0];
            let found = Corrected::new(point, scaled(ray + t * depth, f), scaled(t, f), noise);
            let depth = depth + found.correction;
            let derivatives = [0, 1].map(|k| {
                let g = scaled(found.gradients[k], f);
                // g·(ω × Rρ) = ω·(Rρ × g).
                let (turn, along) = (ray.cross(&g), -g.dot(&t));
                let focal = g.dot(&axis) + found.coordinates[k];
                row(turn, g * depth, [focal, along, 0.0, 0.0])
            });
            found.add(equations, noise, derivatives);
        }
    }

    fn add_reverse(&self, cameras: &Cameras, equations: &mut NormalEquations<PARAMETERS>) {
        let (noise, f) = (&self.noise[1], cameras.focal());
        let (r, t, ratio) = (&cameras.rotation, cameras.translation, cameras.ratio);
        let reverse = cameras.reverse_translation();
        for point in self.points[1].iter() {
            let ray = Vector3::new(point.x, point.y, f);
            let depth = point.d - cameras.shift[1];
            let image = r.tr_mul(&ray) + reverse * depth;
            let found = Corrected::new(point, scaled(image, f), scaled(reverse, f), noise);
            let depth = depth + found.correction;
            let moved = ray - t * (ratio * depth);
            let derivatives = [0, 1].map(|k| {
                // In the reference's frame: g·Rᵀ(−ω × n) = ω·(Rg × n).
                let g = r * scaled(found.gradients[k], f);
                let along = g.dot(&t);
                let focal = f * g[2] + found.coordinates[k];
                row(g.cross(&moved), g * (-ratio * depth), [focal, 0.0, -depth * along, ratio * along])
            });
            found.add(equations, noise, derivatives);
        }
    }
}

/// A vector in front of the camera as a homogeneous image, diag(f, f, 1)·v; its own transpose.
fn scaled(v: Vector3<f64>, focal: f64) -> Vector3<f64> {
    Vector3::new(focal * v[0], focal * v[1], v[2])
}

fn row(rotation: Vector3<f64>, translation: Vector3<f64>, [focal, shift, ratio, reverse]: [f64; 4]) -> Derivatives {
    let ([a, b, c], [x, y, z]) = (rotation.into(), translation.into());
    Derivatives::from_column_slice(&[a, b, c, x, y, z, focal, shift, ratio, reverse])
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// Uniform between -1 and 1, from a linear congruential generator.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 5u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn gradient_is_that_of_the_cost() {
        let mut next = numbers();
        let rest = Cameras {
            rotation: Matrix3::identity(),
            translation: Vector3::new(0.05, -0.03, 0.02),
            log_focal: -0.3,
            shift: [-2.0, -1.5],
            ratio: 1.3,
        };
        let cameras = rest.moved(&row(Vector3::new(0.1, -0.2, 0.15), Vector3::zeros(), [0.0; 4]));
        let mut points = [Correspondences::default(), Correspondences::default()];
        for (points, p) in points.iter_mut().zip(&cameras.projections()) {
            for _ in 0..40 {
                let (x, y, d) = (0.3 * next(), 0.3 * next(), next());
                let [a, b, w] = transform(p, x, y, d);
                points.push([x, y], d + 0.1 * next(), [a / w + 2e-3 * next(), b / w + 2e-3 * next()]);
            }
        }
        let priors = Priors { log_focal: [-0.35, 0.35], shift: [[-1.0, 1.0], [-1.0, 0.5]] };
        // A reliable depth, and an unreliable one.
        for depth in [1e-12, 1e-2] {
            let noise = [Noise { point: 1e-6, depth, exact: true }; 2];
            let problem = Reprojection { points: [&points[0], &points[1]], noise, priors };
            let NormalEquations { gradient, matrix, cost: least } = problem.normal_equations(&cameras);
            for i in 0..PARAMETERS {
                let cost = |by: f64| {
                    let mut step = Derivatives::zeros();
                    step[i] = by;
                    problem.normal_equations(&cameras.moved(&step)).cost
                };
                let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
                // The corrections are exact to the first order only. No slope can exceed this scale.
                let scale = (2.0 * least * matrix[(i, i)]).sqrt();
                assert!((slope - gradient[i]).abs() < 1e-3 * scale, "{i}: {slope} {} of {scale}", gradient[i]);
            }
        }
    }
}
