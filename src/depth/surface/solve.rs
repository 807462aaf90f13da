//! The reweighted equations, by preconditioned conjugate gradients.

use wide::f64x4;

use super::lines::Line;
use super::mesh::{Datum, Mesh, Term};
use super::{ROBUST, robust};
use crate::Result;
use crate::depth::diagonals::{Diagonals, Factor, add_scaled, dot};

/// Steps of the conjugate gradients at most, and the share of the residual they leave: that of a change, which is small in the end.
const STEPS: usize = 12;
const TOLERANCE: f64 = 1e-2;

/// Where the surface is tight at the border of the overlap: how much more a sample weighs there, and how much farther off it may be before it
/// counts as an outlier. How well what is hidden of 54 real pairs is placed is flat between a third and three times the first, and at half the second.
const TIGHT_WEIGHT: f64 = 10.0;
const TIGHT_TOLERANCE: f64 = 20.0;

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

    /// Adds samples, weighted by how well `values` fulfil them: first those that follow each other in one cell to each other.
    fn add_data(&mut self, data: &[Datum], tight: bool, values: &[f64], pass: usize) {
        for cell in data.chunk_by(|a, b| a.term.nodes == b.term.nodes) {
            let mut block = Block::ZERO;
            for Datum { term, nearness } in cell {
                let near = if tight { *nearness } else { 0.0 };
                let residual = term.residual(values) / (1.0 + TIGHT_TOLERANCE * near);
                let share = if pass == 0 { 1.0 } else { robust(residual, pass >= ROBUST) };
                block.add(term, term.weight * (1.0 + TIGHT_WEIGHT * near) * share);
            }
            self.add_block(&cell[0].term.nodes, &block);
        }
    }

    fn add_block(&mut self, nodes: &[usize; 4], block: &Block) {
        for (i, (&n, row)) in nodes.iter().zip(&block.matrix).enumerate() {
            self.right[n] += block.right.as_array_ref()[i];
            for (&m, &value) in nodes[..=i].iter().zip(row.as_array_ref()).filter(|(_, value)| **value != 0.0) {
                self.matrix.add(n, m, value);
            }
        }
    }
}

/// The normal equations of the vertices of one cell.
struct Block {
    matrix: [f64x4; 4],
    right: f64x4,
}

impl Block {
    const ZERO: Self = Self { matrix: [f64x4::ZERO; 4], right: f64x4::ZERO };

    fn of(term: &Term, weight: f64) -> Self {
        let mut block = Self::ZERO;
        block.add(term, weight);
        block
    }

    fn add(&mut self, term: &Term, weight: f64) {
        let coefficients = f64x4::new(term.coefficients);
        for (row, c) in self.matrix.iter_mut().zip(term.coefficients) {
            *row += coefficients * f64x4::splat(weight * c);
        }
        self.right += coefficients * f64x4::splat(weight * term.target);
    }
}

/// One reweighted solution of a system that stays the same, `data`, and lines.
pub(super) fn reweighted(
    mut system: System,
    (data, tight): (&[Datum], bool),
    lines: &mut [Line],
    start: &[f64],
    pass: usize,
) -> Result<Option<Vec<f64>>> {
    system.add_data(data, tight, start, pass);
    for line in lines.iter_mut() {
        line.reweight(start, pass);
        for (term, weight) in line.terms.iter().zip(&line.weights) {
            system.add_block(&term.nodes, &Block::of(term, *weight));
        }
    }
    let System { matrix, mut right } = system;
    lines.iter().for_each(|line| line.release_targets(&mut right));
    let Some(factor) = matrix.cholesky()? else { return Ok(None) };
    Ok(Some(conjugate_gradients(&matrix, &factor, lines, right, start)))
}

/// The matrix has the lines pull to 0 rather than to be affine: it only preconditions.
fn conjugate_gradients(
    matrix: &Diagonals,
    factor: &Factor,
    lines: &[Line],
    right: Vec<f64>,
    start: &[f64],
) -> Vec<f64> {
    let apply = |x: &[f64]| {
        let mut out = matrix.multiply(x);
        lines.iter().for_each(|line| line.release(x, &mut out));
        out
    };
    let mut x = start.to_vec();
    let mut residual = right;
    add_scaled(&mut residual, &apply(&x), -1.0);
    let precondition = |residual: &[f64]| {
        let mut z = residual.to_vec();
        factor.solve(&mut z);
        z
    };
    let mut z = precondition(&residual);
    let mut direction = z.clone();
    let mut product = dot(&residual, &z);
    let enough = TOLERANCE * TOLERANCE * product;
    for _ in 0..STEPS {
        if product.is_nan() || product <= enough || product <= 0.0 {
            break;
        }
        let applied = apply(&direction);
        let step = product / dot(&direction, &applied);
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut residual, &applied, -step);
        z = precondition(&residual);
        let next = dot(&residual, &z);
        let share = next / product;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        product = next;
    }
    x
}
