//! The reweighted equations, by preconditioned conjugate gradients.

use super::lines::Line;
use super::mesh::{Mesh, Term};
use super::samples::{Block, Samples};
use crate::Result;
use crate::depth::diagonals::{Diagonals, Factor, add_scaled, dot};

/// The share of the residual that the conjugate gradients leave: that of a change, which is small in the end.
const TOLERANCE: f64 = 1e-2;

/// How far the equations are solved.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Solution {
    /// So that hardly anything of the residual is left.
    Full,
    /// So that what nothing but lines determines, far from all samples, stays near the background. Of two photos alone that displaces what only one
    /// shows by 5 % more and bends it by 18 % more; but in sets, where others see what lies outside, what is fully solved is displaced twice as far,
    /// and so are corrections of given maps.
    Damped,
}

impl Solution {
    /// Steps of the conjugate gradients at most.
    fn steps(self) -> usize {
        match self {
            Self::Full => 24,
            Self::Damped => 12,
        }
    }

    /// Whether the preconditioner has the lines pull to 0, so that what moves them comes last.
    fn pulls_lines(self) -> bool {
        self == Self::Damped
    }
}

/// Normal equations.
#[derive(Clone)]
pub(super) struct System {
    matrix: Diagonals,
    right: Vec<f64>,
}

impl System {
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let side = mesh.columns.min(mesh.rows);
        // Vertices of one cell, and those of second differences; more frequent ones first.
        let offsets = vec![0, 1, side, side + 1, side - 1, 2, 2 * side];
        let matrix = Diagonals::new(mesh.len(), offsets)?;
        Ok(Self { matrix, right: vec![0.0; mesh.len()] })
    }

    /// Adds terms that are never outliers, times a factor.
    pub fn add(&mut self, terms: &[Term], factor: f64) {
        for term in terms {
            self.add_block(&term.nodes, &Block::of(term, factor * term.weight));
        }
    }

    fn add_block(&mut self, nodes: &[usize; 4], block: &Block) {
        for (i, (&n, row)) in nodes.iter().zip(&block.matrix).enumerate() {
            self.right[n] += block.right[i];
            for (&m, &value) in nodes[..=i].iter().zip(row).filter(|(_, value)| **value != 0.0) {
                self.matrix.add(n, m, value);
            }
        }
    }
}

/// One reweighted solution of a system that stays the same, `samples`, and lines.
pub(super) fn reweighted(
    mut system: System,
    (samples, tight): (&Samples, bool),
    lines: &mut [Line],
    start: &[f64],
    pass: usize,
    solution: Solution,
) -> Result<Option<Vec<f64>>> {
    samples.for_each_cell(start, tight, pass, &mut |nodes, block| system.add_block(nodes, block));
    for line in lines.iter_mut() {
        line.reweight(start, pass);
        if solution.pulls_lines() {
            for (term, weight) in line.terms.iter().zip(&line.weights) {
                system.add_block(&term.nodes, &Block::of(term, *weight));
            }
        }
    }
    let System { matrix, mut right } = system;
    lines.iter().for_each(|line| line.add_right(solution.pulls_lines(), &mut right));
    let Some(factor) = matrix.cholesky()? else { return Ok(None) };
    Ok(Some(conjugate_gradients(&matrix, &factor, (lines, solution), right, start)))
}

/// The matrix does not have the lines be affine, which would fill it: it preconditions.
fn conjugate_gradients(
    matrix: &Diagonals,
    factor: &Factor,
    (lines, solution): (&[Line], Solution),
    right: Vec<f64>,
    start: &[f64],
) -> Vec<f64> {
    let apply = |x: &[f64]| {
        let mut out = matrix.multiply(x);
        lines.iter().for_each(|line| line.add_product(x, solution.pulls_lines(), &mut out));
        out
    };
    let mut x = start.to_vec();
    let mut residual = right;
    add_scaled(&mut residual, &apply(&x), -1.0);
    let mut z = factor.solve(&residual);
    let mut direction = z.clone();
    let mut product = dot(&residual, &z);
    let enough = TOLERANCE * TOLERANCE * product;
    for _ in 0..solution.steps() {
        if product.is_nan() || product <= enough || product <= 0.0 {
            break;
        }
        let applied = apply(&direction);
        let step = product / dot(&direction, &applied);
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut residual, &applied, -step);
        z = factor.solve(&residual);
        let next = dot(&residual, &z);
        let share = next / product;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        product = next;
    }
    x
}
