//! What samples say about the values at the vertices of the mesh, four samples of a cell at a time.

use std::ops::Range;

use wide::f32x4;

use super::ROBUST;
use super::mesh::{Mesh, Term};
use crate::Result;
use crate::geometry::{DepthSample, plane_depth};
use crate::image::{defaults, reserve_more};
use crate::lanes::LANES;

/// Where the surface is tight at the border of the overlap: how much more a sample weighs there, and how much farther off it may be before it
/// counts as an outlier. How well what is hidden of 54 real pairs is placed is flat between a third and three times the first, and at half the second.
const TIGHT_WEIGHT: f32 = 10.0;
const TIGHT_TOLERANCE: f32 = 20.0;

/// What one sample says.
#[derive(Clone)]
struct Sample {
    /// Of the cell around it.
    term: Term,
    nearness: f64,
}

/// The samples of a surface, cell by cell.
pub(super) struct Samples {
    cells: Vec<Cell>,
    fours: Vec<Four>,
}

struct Cell {
    nodes: [usize; 4],
    fours: Range<usize>,
}

/// Four samples of one cell; those that are missing weigh nothing.
#[derive(Clone, Copy)]
struct Four {
    coefficients: [f32x4; 4],
    target: f32x4,
    weight: f32x4,
    /// How near the border of the overlap they are: from 0, far away, to 1.
    nearness: f32x4,
}

/// Normal equations of the values at four vertices: the lower triangle of their matrix, and the right side.
pub(super) struct Block {
    pub matrix: [[f64; 4]; 4],
    pub right: [f64; 4],
}

impl Block {
    /// Of one term.
    pub fn of(term: &Term, weight: f64) -> Self {
        let c = term.coefficients;
        Self { matrix: c.map(|a| c.map(|b| weight * a * b)), right: c.map(|c| weight * c * term.target) }
    }
}

impl Samples {
    /// `samples` of a photo, [`Mesh::sample_step`] apart, and its `matches`, each of which counts as a whole cell. What they are compared with are
    /// deviations from the `plane` in pixels, of which a unit of inverse depth usually is `parallax`.
    pub fn new(
        mesh: &Mesh,
        [samples, matches]: [&[DepthSample]; 2],
        plane: [f64; 3],
        parallax: f64,
        nearness: &dyn Fn(&DepthSample) -> f64,
    ) -> Result<Self> {
        let mut cells: Vec<Vec<Sample>> = defaults(mesh.len())?;
        for (samples, weight) in [(samples, mesh.sample_weight()), (matches, 1.0)] {
            for s in samples {
                let (nodes, weights) = mesh.cell(s.point);
                let ratio = (s.parallax / parallax).clamp(0.1, 10.0);
                let target = (s.depth - plane_depth(plane, s.point)) * parallax * ratio;
                let term = Term { nodes, coefficients: weights.map(|w| w * ratio), target, weight };
                reserve_more(&mut cells[nodes[0]], 1)?;
                cells[nodes[0]].push(Sample { term, nearness: nearness(s) });
            }
        }
        let mut found = Self { cells: Vec::new(), fours: Vec::new() };
        for samples in cells {
            let Some(nodes) = samples.first().map(|sample| sample.term.nodes) else { continue };
            let from = found.fours.len();
            reserve_more(&mut found.fours, samples.len().div_ceil(LANES))?;
            found.fours.extend(samples.chunks(LANES).map(Four::of));
            reserve_more(&mut found.cells, 1)?;
            found.cells.push(Cell { nodes, fours: from..found.fours.len() });
        }
        Ok(found)
    }

    /// The normal equations of each cell, its samples weighted by how well `values` fulfil them.
    pub fn for_each_cell(&self, values: &[f64], tight: bool, pass: usize, act: &mut dyn FnMut(&[usize; 4], &Block)) {
        let tight = f32x4::splat(if tight { 1.0 } else { 0.0 });
        for Cell { nodes, fours } in &self.cells {
            let values = nodes.map(|node| f32x4::splat(values[node] as f32));
            let mut sums = Sums::default();
            for four in &self.fours[fours.clone()] {
                let near = tight * four.nearness;
                let share = if pass == 0 { f32x4::ONE } else { four.robust(values, near, pass >= ROBUST) };
                sums.add(four, four.weight * (f32x4::ONE + TIGHT_WEIGHT * near) * share);
            }
            act(nodes, &sums.block());
        }
    }
}

impl Four {
    fn of(samples: &[Sample]) -> Self {
        let mut lanes = [[0.0; LANES]; 7];
        for (i, Sample { term, nearness }) in samples.iter().enumerate() {
            let [p, q, r, s] = term.coefficients;
            let values = [p, q, r, s, term.target, term.weight, *nearness];
            lanes.iter_mut().zip(values).for_each(|(lane, value)| lane[i] = value as f32);
        }
        let [p, q, r, s, target, weight, nearness] = lanes.map(f32x4::new);
        Self { coefficients: [p, q, r, s], target, weight, nearness }
    }

    /// As [`robust`](super::robust), of samples that may be the farther off the nearer the border they are.
    fn robust(&self, [p, q, r, s]: [f32x4; 4], near: f32x4, late: bool) -> f32x4 {
        let [a, b, c, d] = self.coefficients;
        let residual = (a * p + b * q) + (c * r + d * s) - self.target;
        let residual = residual / (f32x4::ONE + TIGHT_TOLERANCE * near);
        let weight = f32x4::ONE / (f32x4::ONE + residual * residual).sqrt();
        if late { weight * weight.sqrt() } else { weight }
    }
}

/// Sums of normal equations, lane by lane.
#[derive(Default)]
struct Sums {
    matrix: [[f32x4; 4]; 4],
    right: [f32x4; 4],
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, four: &Four, weight: f32x4) {
        for i in 0..4 {
            let weighted = weight * four.coefficients[i];
            self.right[i] += weighted * four.target;
            for j in 0..=i {
                self.matrix[i][j] += weighted * four.coefficients[j];
            }
        }
    }

    fn block(&self) -> Block {
        let sum = |lanes: f32x4| {
            let [p, q, r, s] = lanes.to_array().map(f64::from);
            (p + q) + (r + s)
        };
        Block { matrix: self.matrix.map(|row| row.map(sum)), right: self.right.map(sum) }
    }
}
