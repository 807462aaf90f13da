//! Levenberg–Marquardt on the normal equations, with the damping of H. B. Nielsen, *Damping Parameter in Marquardt's
//! Method* (1999). Normalised coordinates condition the equations well enough, and one pass over the matches sums them.

use nalgebra::{SMatrix, SVector};

/// Damping to start with, as a fraction of the largest diagonal entry (Nielsen's τ, for a good start).
const DAMPING: f64 = 1e-6;

/// ½Σr² at a state, its gradient Jᵀr, and JᵀJ, of which only the lower triangle is read.
pub(super) struct NormalEquations<const N: usize> {
    pub cost: f64,
    pub gradient: SVector<f64, N>,
    pub matrix: SMatrix<f64, N, N>,
}

impl<const N: usize> NormalEquations<N> {
    /// Of no residual.
    pub fn zeros() -> Self {
        Self { cost: 0.0, gradient: SVector::zeros(), matrix: SMatrix::zeros() }
    }

    /// Adds a residual of this `weight` with these `derivatives`; the cost is up to the caller.
    pub fn add(&mut self, derivatives: &SVector<f64, N>, residual: f64, weight: f64) {
        self.gradient.axpy(weight * residual, derivatives, 1.0);
        self.matrix.syger(weight, derivatives, derivatives, 1.0);
    }
}

impl<const N: usize> Linearised for NormalEquations<N> {
    type Step = SVector<f64, N>;

    fn cost(&self) -> f64 {
        self.cost
    }

    fn initial_damping(&self) -> f64 {
        DAMPING * self.matrix.diagonal().max()
    }

    fn step(&self, damping: f64) -> Option<(Self::Step, f64)> {
        let damped = self.matrix + SMatrix::from_diagonal_element(damping);
        let step = damped.cholesky()?.solve(&-self.gradient);
        let predicted = 0.5 * step.dot(&(step * damping - self.gradient));
        Some((step, predicted))
    }
}

/// A cost linearised at one state.
pub(super) trait Linearised {
    type Step;
    fn cost(&self) -> f64;
    fn initial_damping(&self) -> f64;
    /// The step of the equations damped by `damping`, and the reduction of the cost that they predict; `None` unless they are
    /// positive definite.
    fn step(&self, damping: f64) -> Option<(Self::Step, f64)>;
}

/// A cost that can be linearised at any state.
pub(super) trait LeastSquares {
    type State;
    type Equations: Linearised;
    fn normal_equations(&self, state: &Self::State) -> Self::Equations;
    fn moved(&self, state: &Self::State, step: &<Self::Equations as Linearised>::Step) -> Self::State;
}

/// Minimises from `start`; the state found, never worse, and its cost. Stops when a step reduces the cost by less than the
/// fraction `tolerance`, or after so many `iterations`.
pub(super) fn minimise<P: LeastSquares>(
    problem: &P,
    start: P::State,
    tolerance: f64,
    iterations: usize,
) -> (P::State, f64) {
    let mut state = start;
    let mut equations = problem.normal_equations(&state);
    let (mut damping, mut growth) = (equations.initial_damping(), 2.0);
    for _ in 0..iterations {
        if let Some((step, predicted)) = equations.step(damping) {
            let moved = problem.moved(&state, &step);
            let next = problem.normal_equations(&moved);
            let small = |reduction: f64| reduction <= tolerance * equations.cost();
            if next.cost() < equations.cost() {
                let reduction = equations.cost() - next.cost();
                let converged = small(reduction) && small(predicted);
                let excess = 2.0 * reduction / predicted - 1.0;
                damping *= (1.0 - excess * excess * excess).max(1.0 / 3.0);
                growth = 2.0;
                (state, equations) = (moved, next);
                if converged {
                    break;
                }
                continue;
            }
            if small(predicted) {
                break;
            }
        }
        damping *= growth;
        growth *= 2.0;
    }
    (state, equations.cost())
}
