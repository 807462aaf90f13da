//! Levenberg–Marquardt on the normal equations, with the damping of H. B. Nielsen, *Damping Parameter in Marquardt's
//! Method* (1999). Normalised coordinates condition the equations well enough, and one pass over the matches gathers them.

// Indices mirror the algebra.
#![allow(clippy::needless_range_loop)]

use super::linear::solve;

/// How many numbers a problem can have. Those that it has not are 0 in its gradient and its matrix, and never move: one
/// solver for all is less code.
pub(super) const NUMBERS: usize = 11;

/// ½Σr² at a state, its gradient Jᵀr, and the lower triangle of JᵀJ.
pub(super) struct Normal {
    pub cost: f64,
    pub gradient: [f64; NUMBERS],
    pub matrix: [[f64; NUMBERS]; NUMBERS],
}

impl Normal {
    /// Of no equation.
    pub fn empty() -> Self {
        Self { cost: 0.0, gradient: [0.0; NUMBERS], matrix: [[0.0; NUMBERS]; NUMBERS] }
    }

    /// Adds an equation: `row` are the derivatives of its residual, `slope` is the residual times its `weight`.
    #[inline(never)]
    pub fn gather(&mut self, row: &[f64; NUMBERS], slope: f64, weight: f64) {
        for (r, (sums, gradient)) in self.matrix.iter_mut().zip(&mut self.gradient).enumerate() {
            // Many numbers play no part in an equation.
            if row[r] != 0.0 {
                *gradient += slope * row[r];
                let weighted = weight * row[r];
                sums.iter_mut().zip(&row[..=r]).for_each(|(sum, v)| *sum += weighted * v);
            }
        }
    }

    /// The step of the equations damped by `damping`, and by how much the cost should fall.
    #[inline(never)]
    fn step(&self, damping: f64) -> Option<([f64; NUMBERS], f64)> {
        let mut factor = self.matrix;
        for i in 0..NUMBERS {
            factor[i][i] += damping;
        }
        let mut step = self.gradient.map(|g| -g);
        solve(factor.as_flattened_mut(), &mut step)?;
        let fall = step.iter().zip(&self.gradient).map(|(s, g)| 0.5 * s * (damping * s - g)).sum();
        Some((step, fall))
    }
}

/// A cost that can be linearised at any state.
pub(super) trait LeastSquares {
    type State: Copy;
    fn normal(&self, state: &Self::State) -> Normal;
    fn moved(&self, state: &Self::State, step: &[f64; NUMBERS]) -> Self::State;
}

/// Minimises from `start`; the state found, never worse, and its cost. Stops when a step gains less than the share
/// `tolerance`, or after `tries` of them.
pub(super) fn minimise<P: LeastSquares>(problem: &P, start: P::State, tolerance: f64, tries: usize) -> (P::State, f64) {
    let mut state = start;
    let cost = descend(problem.normal(&start), tolerance, tries, &mut |step, cost| {
        let moved = problem.moved(&state, step);
        let normal = problem.normal(&moved);
        if normal.cost < cost {
            state = moved;
        }
        normal
    });
    (state, cost)
}

/// The way down from where the equations are `normal`: one copy of it for all problems. `attempt` tells how they are after
/// a step, which it keeps when they cost less than what it is given. Returns the last cost kept.
#[inline(never)]
fn descend(
    mut normal: Normal,
    tolerance: f64,
    tries: usize,
    attempt: &mut dyn FnMut(&[f64; NUMBERS], f64) -> Normal,
) -> f64 {
    let largest = (0..NUMBERS).fold(0.0f64, |largest, i| largest.max(normal.matrix[i][i]));
    let (mut damping, mut growth) = (1e-6 * largest, 2.0);
    for _ in 0..tries {
        if let Some((step, fall)) = normal.step(damping) {
            let next = attempt(&step, normal.cost);
            let small = |fall: f64| fall <= tolerance * normal.cost;
            if next.cost < normal.cost {
                let fallen = normal.cost - next.cost;
                let done = small(fallen) && small(fall);
                let excess = 2.0 * fallen / fall - 1.0;
                damping *= (1.0 - excess * excess * excess).max(1.0 / 3.0);
                growth = 2.0;
                normal = next;
                if done {
                    break;
                }
                continue;
            }
            if small(fall) {
                break;
            }
        }
        damping *= growth;
        growth *= 2.0;
    }
    normal.cost
}
