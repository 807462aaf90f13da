//! Least squares on the transfer error (paper, equation 9), for both the homography and the depth model.

use nalgebra::{Matrix3x4, Matrix4, SMatrix, SVector, Vector4};

use crate::geometry::correspondences::{Correspondences, ProjectionMatrix, transform};
use crate::geometry::levenberg_marquardt::{LeastSquares, NormalEquations, minimise};

/// Most iterations.
const ITERATIONS: usize = 100;

/// The entries of a projection row by row, each in the order x, y, d, 1. The last one, (3, 3), is fixed at 1: in
/// normalised coordinates it is the third coordinate of the matches' mean point, hence positive in front of the camera.
const UNKNOWNS: usize = 11;
const COLUMNS: [usize; 4] = [0, 1, 3, 2];

/// The squared transfer errors of `points`. Without `depth` the last column has no effect: its gradient is 0.
struct TransferErrors<'a> {
    points: &'a Correspondences,
    depth: bool,
}

impl LeastSquares for TransferErrors<'_> {
    type State = ProjectionMatrix;
    type Equations = NormalEquations<UNKNOWNS>;

    fn normal_equations(&self, p: &ProjectionMatrix) -> NormalEquations<UNKNOWNS> {
        let mut cost = 0.0;
        let mut gradient = Matrix3x4::zeros();
        // Σ weight·mmᵀ with the weights 1, −u, −v and u² + v², m being (x, y, d, 1) over the third coordinate.
        let mut moments = [Matrix4::<f64>::zeros(); 4];
        for point in self.points.iter() {
            let d = if self.depth { point.d } else { 0.0 };
            let [a, b, w] = transform(p, point.x, point.y, d);
            // A point that a step moves behind the camera is projected far away, so that the step is rejected.
            let inverse = 1.0 / w.max(1e-9);
            let (u, v) = (a * inverse, b * inverse);
            let (du, dv) = (u - point.u, v - point.v);
            cost += 0.5 * (du * du + dv * dv);
            let m = Vector4::new(point.x, point.y, d, 1.0) * inverse;
            for (r, slope) in [du, dv, -(u * du + v * dv)].into_iter().enumerate() {
                for c in 0..4 {
                    gradient[(r, c)] += slope * m[c];
                }
            }
            let mm = m * m.transpose();
            for (moment, weight) in moments.iter_mut().zip([1.0, -u, -v, u * u + v * v]) {
                *moment += mm * weight;
            }
        }
        // The derivatives of u do not depend on the second row of the projection, nor those of v on the first.
        const BLOCKS: [[Option<usize>; 3]; 3] =
            [[Some(0), None, Some(1)], [None, Some(0), Some(2)], [Some(1), Some(2), Some(3)]];
        let entry = |i: usize, j: usize| BLOCKS[i / 4][j / 4].map_or(0.0, |block| moments[block][(i % 4, j % 4)]);
        NormalEquations {
            cost,
            gradient: SVector::from_fn(|i, _| gradient[(i / 4, i % 4)]),
            matrix: SMatrix::from_fn(entry),
        }
    }

    fn moved(&self, projection: &ProjectionMatrix, step: &SVector<f64, UNKNOWNS>) -> ProjectionMatrix {
        let mut moved = *projection;
        for (i, s) in step.iter().enumerate() {
            moved[(i / 4, COLUMNS[i % 4])] += s;
        }
        moved
    }
}

/// Minimises the sum of squared transfer errors over all of `points` (normalised), starting at `start`, of the depth model
/// or of a homography. Stops when an iteration reduces the cost by less than the fraction `tolerance`; never worse than
/// `start`. The result has 1 at (3, 3).
pub(super) fn refine(
    points: &Correspondences,
    start: &ProjectionMatrix,
    depth: bool,
    tolerance: f64,
) -> ProjectionMatrix {
    let scale = start[(2, 2)];
    if scale.is_nan() || scale <= 0.0 {
        return *start;
    }
    minimise(&TransferErrors { points, depth }, start / scale, tolerance, ITERATIONS).0
}
