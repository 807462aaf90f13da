//! Least squares with a number of unknowns that is known at run time only.

use nalgebra::{DMatrix, DVector};

use crate::geometry::levenberg_marquardt::Linearised;

/// Where the robust cost goes from square to linear, in standard deviations (Huber's 1.345 has 95 % efficiency on normal errors).
const HUBER: f64 = 1.5;
/// What an image behind a camera costs: as much as one this far off, in pixels.
const BEHIND: f64 = 50.0;
/// Damping to start with, as a fraction of the diagonal.
const DAMPING: f64 = 1e-4;
/// Least entry of the diagonal that damping is a fraction of: an unknown that nothing depends on does not move.
const LEAST_DIAGONAL: f64 = 1e-9;

/// Huber's cost of an error in pixels, `None` behind the camera, and the weight of its square; `noise` is its standard deviation.
pub(super) fn huber(error: Option<[f64; 2]>, noise: f64) -> (f64, f64) {
    let square = error.map_or(BEHIND * BEHIND, |[x, y]| x * x + y * y) / (noise * noise);
    let error = square.sqrt();
    let (cost, weight) =
        if error <= HUBER { (0.5 * square, 1.0) } else { (HUBER * (error - 0.5 * HUBER), HUBER / error) };
    (cost, weight / (noise * noise))
}

/// Cauchy's cost and weight, in the same way: an outlier counts the less the farther off it is.
pub(super) fn cauchy(error: Option<[f64; 2]>, noise: f64) -> (f64, f64) {
    let square = error.map_or(BEHIND * BEHIND, |[x, y]| x * x + y * y) / (noise * noise);
    (0.5 * libm::log1p(square), 1.0 / (noise * noise * (1.0 + square)))
}

/// A cost, its gradient, and its matrix of second derivatives, of which only the lower triangle is read. Unknowns of different
/// units are damped in proportion to the diagonal (Marquardt).
#[derive(Debug, Clone)]
pub(crate) struct Equations {
    pub cost: f64,
    pub gradient: DVector<f64>,
    pub matrix: DMatrix<f64>,
}

impl Equations {
    /// Of no residual.
    pub fn zeros(count: usize) -> Self {
        Self { cost: 0.0, gradient: DVector::zeros(count), matrix: DMatrix::zeros(count, count) }
    }

    /// Adds to an entry of the matrix, and to the one on the other side of the diagonal.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.matrix[(i.max(j), i.min(j))] += value;
    }

    /// Adds that an unknown is `off` from its mean, of which it has this standard deviation.
    pub fn add_prior(&mut self, i: usize, off: f64, deviation: f64) {
        let weight = 1.0 / (deviation * deviation);
        self.cost += 0.5 * weight * off * off;
        self.gradient[i] += weight * off;
        self.add(i, i, weight);
    }

    /// Adds a residual of both coordinates with its slopes by some of the unknowns; the cost is up to the caller.
    pub fn add_residual(&mut self, slopes: &[(usize, [f64; 2])], residual: [f64; 2], weight: f64) {
        for (a, (i, slope)) in slopes.iter().enumerate() {
            let [x, y] = slope.map(|slope| weight * slope);
            self.gradient[*i] += x * residual[0] + y * residual[1];
            slopes[..=a].iter().for_each(|(j, slope)| self.add(*i, *j, x * slope[0] + y * slope[1]));
        }
    }

    /// Enlarges the diagonal by a fraction of itself, of which it returns the amounts.
    pub fn damp(&mut self, damping: f64) -> DVector<f64> {
        let amounts = self.matrix.diagonal().map(|entry| damping * entry.max(LEAST_DIAGONAL));
        amounts.iter().enumerate().for_each(|(i, amount)| self.matrix[(i, i)] += amount);
        amounts
    }

    /// Where the gradient is zero; `None` unless the matrix is positive definite.
    pub fn solve(self) -> Option<DVector<f64>> {
        let step = -self.matrix.cholesky()?.solve(&self.gradient);
        step.iter().all(|v| v.is_finite()).then_some(step)
    }
}

impl Linearised for Equations {
    type Step = DVector<f64>;

    fn cost(&self) -> f64 {
        self.cost
    }

    fn initial_damping(&self) -> f64 {
        DAMPING
    }

    fn step(&self, damping: f64) -> Option<(Self::Step, f64)> {
        let mut damped = self.clone();
        let amounts = damped.damp(damping);
        let step = damped.solve()?;
        let predicted = 0.5 * step.dot(&(step.component_mul(&amounts) - &self.gradient));
        Some((step, predicted))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn equations_are_solved() {
        let mut equations = Equations::zeros(3);
        for (i, j, value) in [(0, 0, 4.0), (1, 0, 1.0), (1, 1, 3.0), (0, 2, -1.0), (2, 1, 0.5), (2, 2, 2.0)] {
            equations.add(i, j, value);
        }
        // −A (1, 2, 3)ᵀ.
        equations.gradient = DVector::from_vec(vec![-3.0, -8.5, -6.0]);
        let (step, predicted) = equations.step(0.0).unwrap();
        assert!((step - DVector::from_vec(vec![1.0, 2.0, 3.0])).norm() < 1e-12);
        assert!((predicted - 19.0).abs() < 1e-12, "½ xᵀAx is {predicted}");
        equations.add(1, 1, -3.0);
        assert!(equations.step(0.0).is_none());
    }
}
