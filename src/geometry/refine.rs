//! Levenberg–Marquardt on the transfer error (paper, equation 6), for the homography and the depth model alike.

use super::points::{Points, Projection, transform};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, storage::Owned};

/// The parameters of a projection: its rows, but for the entry at (3, 3), which is fixed at 1. In normalised coordinates
/// that entry is the third coordinate of the matches' mean point, hence positive in front of the camera.
struct Transfer<'a> {
    points: &'a Points,
    /// 4 with depth, 3 without.
    columns: usize,
    params: DVector<f64>,
}

/// Where the entry (row, column) of a projection is among the parameters; (2, 2) is none.
fn index(columns: usize, row: usize, column: usize) -> usize {
    row * columns + column - usize::from(row == 2 && column == 3)
}

impl Transfer<'_> {
    fn entries(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let columns = self.columns;
        (0..3).flat_map(move |r| (0..columns).map(move |c| (r, c))).filter(|&at| at != (2, 2))
    }

    fn projection(&self) -> Projection {
        let mut p = [[0.0; 4], [0.0; 4], [0.0, 0.0, 1.0, 0.0]];
        for (r, c) in self.entries() {
            p[r][c] = self.params[index(self.columns, r, c)];
        }
        p
    }

    /// Image and reciprocal of the third coordinate; a point that a step carries behind the camera is kept far off, so
    /// that the step is refused.
    fn image(&self, p: &Projection, i: usize) -> (f64, f64, f64) {
        let [a, b, w] = transform(p, self.points.x[i], self.points.y[i], self.points.d[i]);
        let inverse = 1.0 / w.max(1e-9);
        (a * inverse, b * inverse, inverse)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Transfer<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.params.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.params.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let p = self.projection();
        let n = self.points.len();
        let mut residuals = DVector::zeros(2 * n);
        for i in 0..n {
            let (u, v, _) = self.image(&p, i);
            residuals[2 * i] = u - self.points.u[i];
            residuals[2 * i + 1] = v - self.points.v[i];
        }
        Some(residuals)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let p = self.projection();
        let n = self.points.len();
        let mut jacobian = DMatrix::zeros(2 * n, self.params.len());
        for i in 0..n {
            let (u, v, inverse) = self.image(&p, i);
            let m = [self.points.x[i], self.points.y[i], 1.0, self.points.d[i]].map(|m| m * inverse);
            for (r, c) in self.entries() {
                let column = index(self.columns, r, c);
                if r != 1 {
                    jacobian[(2 * i, column)] = if r == 0 { m[c] } else { -u * m[c] };
                }
                if r != 0 {
                    jacobian[(2 * i + 1, column)] = if r == 1 { m[c] } else { -v * m[c] };
                }
            }
        }
        Some(jacobian)
    }
}

/// Minimises the sum of squared transfer errors over all of `points` (normalised), starting at `start`; `columns` is 4 for
/// the depth model and 3 for a homography. Stops when a step gains less than the share `tolerance`; never worse than
/// `start`. The result has 1 at (3, 3).
pub(super) fn refine(points: &Points, start: &Projection, columns: usize, tolerance: f64) -> Projection {
    let scale = start[2][2];
    if scale.is_nan() || scale <= 0.0 {
        return *start;
    }
    let mut problem = Transfer { points, columns, params: DVector::zeros(3 * columns - 1) };
    for (r, c) in problem.entries() {
        problem.params[index(columns, r, c)] = start[r][c] / scale;
    }
    let solver =
        LevenbergMarquardt::new().with_ftol(tolerance).with_xtol(tolerance).with_gtol(tolerance).with_patience(8);
    let start = problem.projection();
    let (problem, _) = solver.minimize(problem);
    let refined = problem.projection();
    let sum = |p: &Projection| points.errors(p).sum::<f64>();
    if sum(&refined) <= sum(&start) { refined } else { start }
}
