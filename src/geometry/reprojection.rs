//! How far cameras miss the matches, when the depth errs as well as the points.
//!
//! A depth from a single photo errs far more than a match does, and its error moves a point along its epipolar line only.
//! So each match gets the inverse depth, near its own, that suits it best: with variance σ² of the points' coordinates and
//! τ² of the inverse depth, its error is min over δ of |r(d + δ)|²/σ² + δ²/τ². Across the line it counts in full; along the
//! line as much as the depth can be trusted.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::cameras::{Cameras, Vector, added, cross, dot, rotated, transposed};
use super::levenberg_marquardt::{LeastSquares, NUMBERS, Normal};
use super::points::{Points, Projection, transform};
use crate::statistics::median;

/// c² of the robust cost x/(1 + x/c²) of a squared error x (Geman & McClure 1987): from three standard deviations on, a match
/// counts less and less.
pub(super) const CAP: f64 = 9.0;

/// The median of a χ² variable with one degree of freedom.
const CHI_MEDIAN: f64 = 0.455;

/// How many times the variance that the points alone would give the inverse depth, its own may be to pass for exact.
const EXACT: f64 = 4.0;

/// Variances of one direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Of a point's coordinate.
    pub point: f64,
    /// Of the inverse depth.
    pub depth: f64,
    /// Whether the inverse depth errs hardly more than the points do.
    pub exact: bool,
}

impl Noise {
    /// From the errors across and along the epipolar lines; `finest` is the least variance of a point. `None` without
    /// points or without parallax.
    pub fn of(points: &Points, p: &Projection, finest: f64) -> Option<Self> {
        let (mut across, mut along, mut units) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..points.len() {
            let translation = p.map(|row| row[3]);
            let there = There::of(transform(p, points[i].x, points[i].y, points[i].d), 1.0);
            let [du, dv] = [there.place[0] - points[i].u, there.place[1] - points[i].v];
            let [a, b] = there.slope_at(there.place, translation, 1.0);
            let square = a * a + b * b;
            across.push((du * b - dv * a) * (du * b - dv * a) / square);
            along.push((du * a + dv * b) * (du * a + dv * b) / (square * square));
            units.push(1.0 / square);
        }
        let point = (median(across)? / CHI_MEDIAN).max(finest);
        // What the points' own errors make of the depth's.
        let share = point * median(units)?;
        let depth = (median(along)? / CHI_MEDIAN - share).max(0.01 * share);
        (point + depth).is_finite().then_some(Self { point, depth, exact: depth < EXACT * share })
    }

    /// The error of match `i`.
    pub fn error(&self, points: &Points, p: &Projection, i: usize) -> f64 {
        let image = transform(p, points[i].x, points[i].y, points[i].d);
        if image[2] > 0.0 { Seen::of(points, i, image, p.map(|row| row[3]), 1.0, self).error } else { f64::INFINITY }
    }
}

/// Where a point comes to lie.
struct There {
    /// f over the third coordinate.
    scale: f64,
    place: [f64; 2],
}

impl There {
    #[inline(always)]
    fn of(image: Vector, focal: f64) -> Self {
        // A point that a step carries behind the camera is kept far off, so that the step is refused.
        let scale = focal / image[2].max(1e-9);
        Self { scale, place: [image[0] * scale, image[1] * scale] }
    }

    /// How a point at `place` moves with the inverse depth.
    #[inline(always)]
    fn slope_at(&self, place: [f64; 2], translation: Vector, focal: f64) -> [f64; 2] {
        let along = |k: usize| self.scale * (translation[k] - place[k] * translation[2] / focal);
        [along(0), along(1)]
    }
}

/// One match under a noise, its inverse depth corrected.
struct Seen {
    /// δ.
    correction: f64,
    error: f64,
    /// Along the epipolar line and across it: the derivative of the place by ρ',
    gradients: [Vector; 2],
    /// the place, which is also its derivative by the ln f of f·ρ'/ρ'₃,
    places: [f64; 2],
    /// the place less the point seen,
    offs: [f64; 2],
    /// and the share of the match's weight.
    shares: [f64; 2],
}

impl Seen {
    #[inline(never)]
    fn of(points: &Points, i: usize, image: Vector, translation: Vector, focal: f64, noise: &Noise) -> Self {
        let (seen, ratio) = ([points[i].u, points[i].v], noise.point / noise.depth);
        let off = |there: &There| [there.place[0] - seen[0], there.place[1] - seen[1]];
        // r(d + δ) is a linear function of δ, which has the slope at the point seen, over the third coordinate.
        let there = There::of(image, focal);
        let ([du, dv], [a, b]) = (off(&there), there.slope_at(seen, translation, focal));
        let step = -(du * a + dv * b) / (a * a + b * b + ratio);
        // It must not carry the point through the camera.
        let approach = -step * translation[2] / image[2].max(1e-9);
        let correction = if approach > 0.9 { step * 0.9 / approach } else { step };
        let there = There::of(added(image, translation, correction), focal);
        let ([du, dv], [a, b]) = (off(&there), there.slope_at(there.place, translation, focal));
        let square = a * a + b * b;
        let length = square.sqrt().max(1e-300);
        let [a, b] = [a / length, b / length];
        let lines = [[a, b], [-b, a]];
        let places = lines.map(|[a, b]| a * there.place[0] + b * there.place[1]);
        Self {
            correction,
            error: (du * du + dv * dv) / noise.point + correction * correction / noise.depth,
            gradients: [0, 1].map(|k| [lines[k][0], lines[k][1], -places[k] / focal].map(|v| v * there.scale)),
            places,
            offs: lines.map(|[a, b]| a * du + b * dv),
            shares: [ratio / (square + ratio), 1.0],
        }
    }

    /// Adds the match to the equations; the rows are the derivatives of both directions by the numbers, `places` apart.
    #[inline(never)]
    fn gather(&self, normal: &mut Normal, noise: &Noise, mut rows: [[f64; NUMBERS]; 2]) {
        let robust = 1.0 / (1.0 + self.error / CAP);
        normal.cost += 0.5 * self.error * robust;
        let weight = robust * robust / noise.point;
        for (k, row) in rows.iter_mut().enumerate() {
            row[6] += self.places[k];
            normal.gather(row, weight * self.offs[k], weight * self.shares[k]);
        }
    }
}

/// What the numbers are expected to be before anything is seen: means with standard deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Priors {
    pub log_focal: [f64; 2],
    pub shift: [[f64; 2]; 2],
}

/// Robust errors in both directions, target to reference first, and the priors.
pub(super) struct Reprojection<'a> {
    pub points: [&'a Points; 2],
    pub noise: [Noise; 2],
    pub priors: Priors,
}

impl LeastSquares for Reprojection<'_> {
    type State = Cameras;

    fn normal(&self, cameras: &Cameras) -> Normal {
        let mut normal = Normal::empty();
        self.forward(cameras, &mut normal);
        self.reverse(cameras, &mut normal);
        let priors = [
            (6, cameras.log_focal, self.priors.log_focal),
            (7, cameras.shift[0], self.priors.shift[0]),
            (9, cameras.shift[1], self.priors.shift[1]),
        ];
        for (i, value, [mean, deviation]) in priors {
            let (off, weight) = (value - mean, 1.0 / (deviation * deviation));
            normal.cost += 0.5 * weight * off * off;
            normal.gradient[i] += weight * off;
            normal.matrix[i][i] += weight;
        }
        normal
    }

    fn moved(&self, cameras: &Cameras, step: &[f64; NUMBERS]) -> Cameras {
        cameras.moved(step)
    }
}

impl Reprojection<'_> {
    #[inline(never)]
    fn forward(&self, cameras: &Cameras, normal: &mut Normal) {
        let (points, noise, focal) = (self.points[0], &self.noise[0], cameras.focal());
        let (r, t) = (&cameras.rotation, cameras.translation);
        let axis = r.map(|row| focal * row[2]);
        for i in 0..points.len() {
            let ray = rotated(r, [points[i].x, points[i].y, focal]);
            let depth = points[i].d - cameras.shift[0];
            let seen = Seen::of(points, i, added(ray, t, depth), t, focal, noise);
            let depth = depth + seen.correction;
            let rows = seen.gradients.map(|g| {
                // g·(ω × Rρ) = ω·(Rρ × g).
                let [a, b, c] = cross(ray, g);
                [a, b, c, g[0] * depth, g[1] * depth, g[2] * depth, dot(g, axis), -dot(g, t), 0.0, 0.0, 0.0]
            });
            seen.gather(normal, noise, rows);
        }
    }

    #[inline(never)]
    fn reverse(&self, cameras: &Cameras, normal: &mut Normal) {
        let (points, noise, focal) = (self.points[1], &self.noise[1], cameras.focal());
        let (r, t, ratio) = (&cameras.rotation, cameras.translation, cameras.ratio);
        let (back, translation) = (transposed(r), cameras.reverse_translation());
        for i in 0..points.len() {
            let ray = [points[i].x, points[i].y, focal];
            let depth = points[i].d - cameras.shift[1];
            let image = added(rotated(&back, ray), translation, depth);
            let seen = Seen::of(points, i, image, translation, focal, noise);
            let depth = depth + seen.correction;
            let moved = added(ray, t, -ratio * depth);
            let rows = seen.gradients.map(|g| {
                // In the reference's frame: g·Rᵀ(−ω × n) = ω·(Rg × n).
                let g = rotated(r, g);
                let ([a, b, c], along, step) = (cross(g, moved), dot(g, t), -ratio * depth);
                let [x, y, z] = g.map(|v| v * step);
                [a, b, c, x, y, z, focal * g[2], 0.0, -depth * along, ratio * along, 0.0]
            });
            seen.gather(normal, noise, rows);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even between -1 and 1, from a linear congruential generator.
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
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.05, -0.03, 0.02],
            log_focal: -0.3,
            shift: [-2.0, -1.5],
            ratio: 1.3,
        };
        let cameras = rest.moved(&[0.1, -0.2, 0.15, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut points = [Points::default(), Points::default()];
        for (points, p) in points.iter_mut().zip(&cameras.projections()) {
            for _ in 0..40 {
                let (x, y, d) = (0.3 * next(), 0.3 * next(), next());
                let [a, b, w] = transform(p, x, y, d);
                points.push([x, y], d + 0.1 * next(), [a / w + 2e-3 * next(), b / w + 2e-3 * next()]);
            }
        }
        let priors = Priors { log_focal: [-0.35, 0.35], shift: [[-1.0, 1.0], [-1.0, 0.5]] };
        // The depth to be trusted fully, and hardly.
        for depth in [1e-12, 1e-2] {
            let noise = [Noise { point: 1e-6, depth, exact: true }; 2];
            let problem = Reprojection { points: [&points[0], &points[1]], noise, priors };
            let Normal { gradient, matrix, cost: least } = problem.normal(&cameras);
            for i in 0..Cameras::FREE {
                let cost = |by: f64| {
                    let mut step = [0.0; NUMBERS];
                    step[i] = by;
                    problem.normal(&cameras.moved(&step)).cost
                };
                let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
                // The corrections are exact to the first order only. No slope can exceed this scale.
                let scale = (2.0 * least * matrix[i][i]).sqrt();
                assert!((slope - gradient[i]).abs() < 1e-3 * scale, "{i}: {slope} {} of {scale}", gradient[i]);
            }
        }
    }
}
