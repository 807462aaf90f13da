//! The field of displacements, by reweighted least squares.

use super::level::Level;
use crate::Result;
use crate::Stage;
use crate::components::neighbours;
use crate::image::{reserve, zeroed};
use crate::observer::{Observer, report};

/// How far from the seam the photos are compared, in diagonals.
pub(super) const BAND: f32 = 0.02;
/// Differences of this many levels count half as much.
const OUTLIER: f32 = 25.0;
/// Weight of the slopes of the field, next to squared levels a node: at a third, lines turn visibly where they cross the seam; at
/// three times, twice as many steps stay.
const SMOOTHNESS: f32 = 330.0;
/// Weight of the field itself at this distance from the seam, growing with its square.
const FADING: f32 = 7.0;
const REACH: f32 = 0.35;
/// What is left of it at the seam.
const LEAST_FADING: f32 = 0.03;
/// Farther than this from the seam, in diagonals, the photos are not compared.
pub(super) const COMPARED: f32 = 2.6 * BAND;
/// Linearisations of a level, and steps of successive overrelaxation of each.
const ITERATIONS: usize = 3;
const SWEEPS: usize = 12;
const OVERRELAXATION: f32 = 1.8;
/// Farther than this from the seam, in diagonals, nothing moves: it has long faded.
pub(super) const FARTHEST: f32 = 0.24;

/// Displacements of a level's nodes, in nodes: the reference's node shows what the target has there.
pub(super) struct Field {
    pub width: usize,
    pub height: usize,
    pub values: Vec<[f32; 2]>,
}

/// The equations of a node: the inverse of a symmetric 2×2 matrix and the right side, without its neighbours' share.
struct Equation {
    node: u32,
    /// Left, right, above and below; itself where there is none.
    around: [u32; 4],
    inverse: [f32; 3],
    right: [f32; 2],
}

impl Equation {
    /// The equations of a node by its own matrix and right side.
    fn of(level: &Level, node: usize, [a, b, c]: [f32; 3], right: [f32; 2]) -> Self {
        let around = neighbours(node, level.width);
        let takes_part = |next: usize| level.distance.get(next).is_some_and(|distance| distance.is_finite());
        let (a, c) = (a + 4.0 * SMOOTHNESS, c + 4.0 * SMOOTHNESS);
        let scale = 1.0 / (a * c - b * b);
        let inverse = [c * scale, b * scale, a * scale];
        Self {
            node: node as u32,
            around: around.map(|next| if takes_part(next) { next } else { node } as u32),
            inverse,
            right,
        }
    }
}

impl Field {
    /// Of a level and the equations of the `edges` there, from the field of the next coarser one.
    pub fn of(level: &Level, edges: &[[f32; 5]], coarser: Option<&Self>, observer: &mut dyn Observer) -> Result<Self> {
        let (width, height) = (level.width, level.height);
        let mut field = Self { width, height, values: zeroed(width * height)? };
        let near = || (0..width * height).filter(|node| level.distance[*node] < FARTHEST);
        if let Some(coarser) = coarser {
            let middle = |i: usize| 0.5 * (i as f32 + 0.5) - 0.5;
            for node in near() {
                field.values[node] = coarser.at(middle(node % width), middle(node / width)).map(|v| 2.0 * v);
            }
        }
        let mut equations = Vec::new();
        reserve(&mut equations, near().count())?;
        for pass in 0..ITERATIONS {
            report(observer, Stage::Blend, pass as f32 / ITERATIONS as f32)?;
            equations.clear();
            equations.extend(near().map(|node| field.equation(level, edges, node)));
            (0..SWEEPS).for_each(|_| field.relax(&equations));
        }
        Ok(field)
    }

    /// Whether a node is farther from the seam than anything moves.
    pub fn is_still(&self, x: usize, y: usize) -> bool {
        self.values[y * self.width + x] == [0.0; 2]
    }

    /// At a point in nodes, bilinear.
    pub fn at(&self, x: f32, y: f32) -> [f32; 2] {
        let axis = |p: f32, count: usize| {
            // Comparisons, as `max` and `min` are calls in wasm.
            let (p, last) = (if p > 0.0 { p } else { 0.0 }, (count - 1) as f32);
            let p = if p < last { p } else { last };
            let i = (p as usize).min(count.saturating_sub(2));
            (i, (i + 1).min(count - 1), p - i as f32)
        };
        let ((i, beside, u), (j, below, v)) = (axis(x, self.width), axis(y, self.height));
        let node = |x: usize, y: usize, c: usize| self.values[y * self.width + x][c];
        [0, 1].map(|c| {
            let row = |y: usize| node(i, y, c) * (1.0 - u) + node(beside, y, c) * u;
            row(j) * (1.0 - v) + row(below) * v
        })
    }

    /// Brightness constancy of a node, linearised at its displacement, what edges say of that, and what draws it to 0.
    #[inline(never)] // see `crate::rows`
    fn equation(&self, level: &Level, edges: &[[f32; 5]], node: usize) -> Equation {
        let share = level.distance[node] / REACH;
        let fading = FADING * share * share + LEAST_FADING;
        let [a, b, c, p, q] = edges.get(node).copied().unwrap_or_default();
        let (a, c) = (a + fading, c + fading);
        let free = || Equation::of(level, node, [a, b, c], [p, q]);
        if level.distance[node] > COMPARED {
            return free();
        }
        let near = level.distance[node] / BAND;
        let [u, v] = self.values[node];
        let (x, y) = ((node % self.width) as f32 + u, (node / self.width) as f32 + v);
        let gx = 0.5 * (level.luma(x + 1.0, y) - level.luma(x - 1.0, y));
        let gy = 0.5 * (level.luma(x, y + 1.0) - level.luma(x, y - 1.0));
        let apart = level.luma(x, y) - level.reference[node];
        if (apart + gx + gy).is_nan() {
            return free();
        }
        let outlier = apart / OUTLIER;
        let weight = libm::exp(f64::from(-near * near)) as f32 / (1.0 + outlier * outlier);
        let constant = weight * (gx * u + gy * v - apart);
        let matrix = [a + weight * gx * gx, b + weight * gx * gy, c + weight * gy * gy];
        Equation::of(level, node, matrix, [p + gx * constant, q + gy * constant])
    }

    /// A step of successive overrelaxation.
    #[inline(never)] // see `crate::rows`
    fn relax(&mut self, equations: &[Equation]) {
        for Equation { node, around, inverse: [a, b, c], right } in equations {
            let [mut p, mut q] = *right;
            for other in around {
                let [u, v] = self.values[*other as usize];
                (p, q) = (p + SMOOTHNESS * u, q + SMOOTHNESS * v);
            }
            for (value, next) in self.values[*node as usize].iter_mut().zip([a * p - b * q, c * q - b * p]) {
                *value += OVERRELAXATION * (next - *value);
            }
        }
    }
}
