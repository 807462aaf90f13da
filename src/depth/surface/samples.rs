//! What samples say about the values at the vertices of the mesh, four samples of a cell at a time.

use std::ops::Range;

use wide::f32x4;

use super::ROBUST;
use super::mesh::{Mesh, Term};
use crate::Result;
use crate::geometry::{DepthSample, plane_depth};
use crate::image::{reserve, zeroed};
use crate::lanes::LANES;

/// Where the surface is tight at the border of the overlap: how much more a sample weighs there, and how much farther off it may be before it
/// counts as an outlier. How well what is hidden of 54 real pairs is placed is flat between a third and three times the first, and at half the second.
const TIGHT_WEIGHT: f32 = 10.0;
const TIGHT_TOLERANCE: f32 = 20.0;

/// The samples of a surface, cell by cell.
pub(super) struct Samples {
    /// By the first of their vertices.
    cells: Vec<Cell>,
    fours: Vec<Four>,
}

struct Cell {
    nodes: [usize; 4],
    fours: Range<usize>,
}

/// Four samples of one cell, of each its coefficients for the four vertices, the target, the weight, and how near the border of the overlap it is:
/// from 0, far away, to 1. Those that are missing weigh nothing.
type Four = [[f32; LANES]; 7];

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
        let all = || {
            let samples = samples.iter().map(|sample| (sample, mesh.sample_weight()));
            samples.chain(matches.iter().map(|sample| (sample, 1.0)))
        };
        // How many of each cell, then how many of them are still to come.
        let mut left: Vec<usize> = zeroed(mesh.len())?;
        all().for_each(|(sample, _)| left[mesh.cell(sample.point).0[0]] += 1);
        let (mut cells, mut end) = (Vec::new(), 0);
        reserve(&mut cells, mesh.len())?;
        cells.extend(left.iter().map(|count| {
            let first = end;
            end += count.div_ceil(LANES);
            Cell { nodes: [0; 4], fours: first..end }
        }));
        let mut fours: Vec<Four> = zeroed(end)?;
        for (sample, weight) in all() {
            let (nodes, shares) = mesh.cell(sample.point);
            let ratio = (sample.parallax / parallax).clamp(0.1, 10.0);
            let target = (sample.depth - plane_depth(plane, sample.point)) * parallax * ratio;
            let [p, q, r, s] = shares.map(|share| share * ratio);
            let (cell, left) = (&mut cells[nodes[0]], &mut left[nodes[0]]);
            cell.nodes = nodes;
            *left -= 1;
            let (four, lane) = (&mut fours[cell.fours.start + *left / LANES], *left % LANES);
            let values = [p, q, r, s, target, weight, nearness(sample)];
            four.iter_mut().zip(values).for_each(|(lanes, value)| lanes[lane] = value as f32);
        }
        Ok(Self { cells, fours })
    }

    /// The normal equations of each cell, its samples weighted by how well `values` fulfil them.
    pub fn for_each_cell(&self, values: &[f64], tight: bool, pass: usize, act: &mut dyn FnMut(&[usize; 4], &Block)) {
        let tight = f32x4::splat(if tight { 1.0 } else { 0.0 });
        for Cell { nodes, fours } in self.cells.iter().filter(|cell| !cell.fours.is_empty()) {
            let values = nodes.map(|node| f32x4::splat(values[node] as f32));
            let mut sums = Sums::default();
            for four in &self.fours[fours.clone()] {
                let [p, q, r, s, target, weight, nearness] = four.map(f32x4::new);
                let (coefficients, near) = ([p, q, r, s], tight * nearness);
                let share = if pass == 0 {
                    f32x4::ONE
                } else {
                    let residual = (p * values[0] + q * values[1]) + (r * values[2] + s * values[3]) - target;
                    robust_lanes(residual / (f32x4::ONE + TIGHT_TOLERANCE * near), pass >= ROBUST)
                };
                sums.add(coefficients, target, weight * (f32x4::ONE + TIGHT_WEIGHT * near) * share);
            }
            act(nodes, &sums.block());
        }
    }
}

/// As [`robust`](super::robust), of four residuals.
fn robust_lanes(residual: f32x4, late: bool) -> f32x4 {
    let weight = f32x4::ONE / (f32x4::ONE + residual * residual).sqrt();
    if late { weight * weight.sqrt() } else { weight }
}

/// Sums of normal equations, lane by lane.
#[derive(Default)]
struct Sums {
    matrix: [[f32x4; 4]; 4],
    right: [f32x4; 4],
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, coefficients: [f32x4; 4], target: f32x4, weight: f32x4) {
        for (i, (row, right)) in self.matrix.iter_mut().zip(&mut self.right).enumerate() {
            let weighted = weight * coefficients[i];
            *right += weighted * target;
            row.iter_mut().zip(&coefficients[..=i]).for_each(|(sum, other)| *sum += weighted * *other);
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
