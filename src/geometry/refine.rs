//! Levenberg–Marquardt on the transfer error (paper, equation 6), for the homography and the depth model alike.
//!
//! On the normal equations, with the damping of H. B. Nielsen, *Damping Parameter in Marquardt's Method* (1999):
//! normalised coordinates condition them well enough, and one pass over the matches gathers them.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::linear::{Square, backward, cholesky};
use super::points::{Points, Projection};

/// The entries of a projection row by row, each in the order x, y, d, 1. The last one, (3, 3), is fixed at 1: in
/// normalised coordinates it is the third coordinate of the matches' mean point, hence positive in front of the camera.
const FREE: usize = 11;
const ORDER: [usize; 4] = [0, 1, 3, 2];

/// ½Σr² at a projection, its gradient Jᵀr, and the lower triangle of JᵀJ.
struct Normal {
    cost: f64,
    gradient: [f64; FREE],
    matrix: Square<FREE>,
}

impl Normal {
    /// Without `depth` the last column counts for nothing: its gradient is 0.
    fn of(points: &Points, p: &Projection, depth: bool) -> Self {
        let mut cost = 0.0;
        let mut gradients = [[0.0; 4]; 3];
        // Σ weight·mmᵀ with the weights 1, −u, −v and u² + v², m being (x, y, d, 1) over the third coordinate.
        let mut moments = [[[0.0; 4]; 4]; 4];
        for i in 0..points.len() {
            let m = [points.x[i], points.y[i], if depth { points.d[i] } else { 0.0 }, 1.0];
            let [a, b, w] = [0, 1, 2].map(|r| p[r][0] * m[0] + p[r][1] * m[1] + p[r][3] * m[2] + p[r][2]);
            // A point that a step carries behind the camera is kept far off, so that the step is refused.
            let inverse = 1.0 / w.max(1e-9);
            let (u, v) = (a * inverse, b * inverse);
            let (du, dv) = (u - points.u[i], v - points.v[i]);
            cost += 0.5 * (du * du + dv * dv);
            let m = m.map(|m| m * inverse);
            let weights = [1.0, -u, -v, u * u + v * v];
            let slopes = [du, dv, -(u * du + v * dv)];
            for c in 0..4 {
                for r in 0..3 {
                    gradients[r][c] += slopes[r] * m[c];
                }
                for k in 0..=c {
                    let mm = m[c] * m[k];
                    for (moment, weight) in moments.iter_mut().zip(weights) {
                        moment[c][k] += weight * mm;
                    }
                }
            }
        }
        let block = [[0, 9, 9], [9, 0, 9], [1, 2, 3]];
        let matrix = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let (r, c) = (i % 4, j % 4);
                moments.get(block[i / 4][j / 4]).map_or(0.0, |moment| moment[r.max(c)][r.min(c)])
            })
        });
        Self { cost, gradient: std::array::from_fn(|i| gradients[i / 4][i % 4]), matrix }
    }

    /// The step of the equations damped by `damping`, and by how much the cost should fall.
    fn step(&self, damping: f64) -> Option<([f64; FREE], f64)> {
        let mut factor = self.matrix;
        for i in 0..FREE {
            factor[i][i] += damping;
        }
        cholesky(&mut factor, 0.0)?;
        let mut rhs = self.gradient.map(|g| -g);
        for r in 0..FREE {
            let dot: f64 = (0..r).map(|k| factor[r][k] * rhs[k]).sum();
            rhs[r] = (rhs[r] - dot) / factor[r][r];
        }
        let step = backward(&factor, rhs);
        let fall = step.iter().zip(&self.gradient).map(|(s, g)| 0.5 * s * (damping * s - g)).sum();
        Some((step, fall))
    }
}

/// Minimises the sum of squared transfer errors over all of `points` (normalised), starting at `start`; `columns` is 4 for
/// the depth model and 3 for a homography. Stops when a step gains less than the share `tolerance`; never worse than
/// `start`. The result has 1 at (3, 3).
pub(super) fn refine(points: &Points, start: &Projection, columns: usize, tolerance: f64) -> Projection {
    const TRIES: usize = 100;
    let scale = start[2][2];
    if scale.is_nan() || scale <= 0.0 {
        return *start;
    }
    let depth = columns > 3;
    let mut projection = start.map(|row| row.map(|v| v / scale));
    let mut normal = Normal::of(points, &projection, depth);
    let largest = (0..FREE).fold(0.0f64, |largest, i| largest.max(normal.matrix[i][i]));
    let (mut damping, mut growth) = (1e-6 * largest, 2.0);
    for _ in 0..TRIES {
        let proposed = normal.step(damping).map(|(step, fall)| {
            let mut moved = projection;
            for (i, s) in step.iter().enumerate() {
                moved[i / 4][ORDER[i % 4]] += s;
            }
            (moved, fall, Normal::of(points, &moved, depth))
        });
        let small = |fall: f64| fall <= tolerance * normal.cost;
        match proposed {
            Some((moved, fall, next)) if next.cost < normal.cost => {
                let fallen = normal.cost - next.cost;
                let done = small(fallen) && small(fall);
                let excess = 2.0 * fallen / fall - 1.0;
                damping *= (1.0 - excess * excess * excess).max(1.0 / 3.0);
                growth = 2.0;
                (projection, normal) = (moved, next);
                if done {
                    break;
                }
            }
            Some((_, fall, _)) if small(fall) => break,
            _ => {
                damping *= growth;
                growth *= 2.0;
            }
        }
    }
    projection
}
