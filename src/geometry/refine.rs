//! Least squares on the transfer error (paper, equation 6), for the homography and the depth model alike.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::levenberg_marquardt::{LeastSquares, NUMBERS, Normal, minimise};
use super::points::{Points, Projection};

/// The entries of a projection row by row, each in the order x, y, d, 1. The last one, (3, 3), is fixed at 1: in
/// normalised coordinates it is the third coordinate of the matches' mean point, hence positive in front of the camera.
const ORDER: [usize; 4] = [0, 1, 3, 2];

/// The squared transfer errors of `points`. Without `depth` the last column counts for nothing: its gradient is 0.
struct Transfer<'a> {
    points: &'a Points,
    depth: bool,
}

impl LeastSquares for Transfer<'_> {
    type State = Projection;

    #[inline(never)]
    fn normal(&self, p: &Projection) -> Normal {
        let Self { points, depth } = *self;
        let mut cost = 0.0;
        let mut gradients = [[0.0; 4]; 3];
        // Σ weight·mmᵀ with the weights 1, −u, −v and u² + v², m being (x, y, d, 1) over the third coordinate.
        let mut moments = [[[0.0; 4]; 4]; 4];
        for i in 0..points.len() {
            let m = [points[i].x, points[i].y, if depth { points[i].d } else { 0.0 }, 1.0];
            let along = |row: &[f64; 4]| row[0] * m[0] + row[1] * m[1] + row[3] * m[2] + row[2];
            let [a, b, w] = [along(&p[0]), along(&p[1]), along(&p[2])];
            // A point that a step carries behind the camera is kept far off, so that the step is refused.
            let inverse = 1.0 / w.max(1e-9);
            let (u, v) = (a * inverse, b * inverse);
            let (du, dv) = (u - points[i].u, v - points[i].v);
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
        Normal { cost, gradient: std::array::from_fn(|i| gradients[i / 4][i % 4]), matrix }
    }

    fn moved(&self, projection: &Projection, step: &[f64; NUMBERS]) -> Projection {
        let mut moved = *projection;
        for (i, s) in step.iter().enumerate() {
            moved[i / 4][ORDER[i % 4]] += s;
        }
        moved
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
    let problem = Transfer { points, depth: columns > 3 };
    minimise(&problem, start.map(|row| row.map(|v| v / scale)), tolerance, TRIES).0
}
