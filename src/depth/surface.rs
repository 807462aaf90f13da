//! A smooth surface of inverse depth over a whole photo, from what is known of it here and there.
//!
//! H∞x + e·d is a homography wherever the inverse depth d is affine in x and y: a surface that bends little keeps straight lines
//! straight. And along the image of any straight line in space d is affine, whatever the depth is beside it.

use super::banded::{Banded, Factor, add_scaled, dot};
use super::interpolation::{diagonal, mean_colour};
use crate::features::LineSegment;
use crate::geometry::{DepthSample, dominant_plane, plane_depth};
use crate::image::reserve;
use crate::statistics::median;
use crate::{ImageView, Result};

/// Cells along the photo's longer side.
const CELLS: usize = 40;
/// Weight of a second difference between vertices, next to the samples of a whole cell.
const BENDING: f64 = 4.0;
/// Colours that differ by this much, in levels over three channels, lower it to 1/√e.
const COLOUR: f64 = 14.0;
/// But to no less than this share.
const LEAST_ALIKE: f64 = 0.01;
/// Second differences in pixels of parallax beyond which the surface rather breaks.
const CREASE: f64 = 0.3;
/// Pull to the dominant plane, where nothing else is known: of slopes and of values, as shares of the bending's weight.
const PLANE: [f64; 2] = [1e-4, 1e-6];
/// Weight of a sample on a straight line.
const LINE: f64 = 8.0;
/// Segments shorter than this share of the diagonal are left out.
const SHORTEST: f64 = 0.04;
/// An occluding edge belongs to the nearer of its sides, in pixels from the line.
const BESIDE: f64 = 2.5;
/// Reweightings, and after how many outliers lose more.
const PASSES: usize = 10;
const ROBUST: usize = 7;
/// Steps of the conjugate gradients at most, and the share of the residual they leave.
const STEPS: usize = 40;
const TOLERANCE: f64 = 1e-3;

/// Values at the vertices of a regular mesh, bilinear between them.
pub(super) struct Surface {
    mesh: Mesh,
    values: Vec<f64>,
}

#[derive(Clone, Copy)]
struct Mesh {
    spacing: f64,
    columns: usize,
    rows: usize,
}

/// A linear residual: the sum of `coefficients` times the values of `nodes`, less `target`.
#[derive(Clone, Copy)]
struct Term {
    nodes: [usize; 4],
    coefficients: [f64; 4],
    target: f64,
    weight: f64,
    /// From this residual on it counts less; 0 for a term that is never an outlier.
    inverse_scale: f64,
}

/// Terms along a straight line, whose values are affine in `along`.
struct Line {
    terms: Vec<Term>,
    along: Vec<f64>,
    weights: Vec<f64>,
}

impl Mesh {
    fn over((w, h): (usize, usize)) -> Self {
        let spacing = ((w.max(h) - 1) as f64 / CELLS as f64).max(1.0);
        let count = |side: usize| ((side - 1) as f64 / spacing).ceil() as usize + 1;
        Self { spacing, columns: count(w).max(2), rows: count(h).max(2) }
    }

    fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Numbered along the shorter side, so that neighbours' numbers are close.
    fn node(&self, x: usize, y: usize) -> usize {
        if self.columns >= self.rows { x * self.rows + y } else { y * self.columns + x }
    }

    fn cell(&self, [x, y]: [f64; 2]) -> ([usize; 4], [f64; 4]) {
        let axis = |p: f64, count: usize| {
            let p = (p / self.spacing).max(0.0).min((count - 1) as f64);
            let i = (p as usize).min(count - 2);
            (i, p - i as f64)
        };
        let ((i, u), (j, v)) = (axis(x, self.columns), axis(y, self.rows));
        (
            [self.node(i, j), self.node(i + 1, j), self.node(i, j + 1), self.node(i + 1, j + 1)],
            [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        )
    }
}

impl Term {
    fn value(&self, x: &[f64]) -> f64 {
        self.nodes.iter().zip(self.coefficients).map(|(&n, c)| c * x[n]).sum()
    }

    fn residual(&self, x: &[f64]) -> f64 {
        self.value(x) - self.target
    }
}

/// Weight of a residual, in units of what is usual: 1/√(1 + r²), or that to the power 3/2.
fn robust(residual: f64, late: bool) -> f64 {
    let weight = 1.0 / (1.0 + residual * residual).sqrt();
    if late { weight * weight.sqrt() } else { weight }
}

impl Surface {
    /// Fits a surface to `samples` of a photo of this size, by reweighted least squares: it bends where the photo has edges
    /// rather than elsewhere, is affine along the `segments`, and far from all samples the dominant plane of them.
    ///
    /// `None` when the samples do not determine a plane.
    pub fn fit(
        samples: &[DepthSample],
        size: (usize, usize),
        photo: Option<ImageView<'_>>,
        segments: &[LineSegment],
    ) -> Result<Option<Self>> {
        let mesh = Mesh::over(size);
        let Some(plane) = dominant_plane(samples, 1.0) else { return Ok(None) };
        let Some(parallax) = median(samples.iter().map(|s| s.parallax).collect()) else { return Ok(None) };
        if !parallax.is_normal() {
            return Ok(None);
        }
        // Deviations from the plane, in pixels of parallax.
        let mut terms = Vec::new();
        reserve(&mut terms, samples.len() + 8 * mesh.len())?;
        mesh.data(samples, plane, parallax, &mut terms);
        mesh.smoothness(photo, &mut terms);
        let mut lines = mesh.lines(segments, size);
        let mut values = vec![0.0; mesh.len()];
        for pass in 0..PASSES {
            let Some(next) = solve(&mesh, &terms, &mut lines, &values, pass)? else { return Ok(None) };
            values = next;
        }
        for x in 0..mesh.columns {
            for y in 0..mesh.rows {
                let value = &mut values[mesh.node(x, y)];
                *value = *value / parallax + plane_depth(plane, [x, y].map(|i| i as f64 * mesh.spacing));
            }
        }
        Ok(Some(Self { mesh, values }))
    }

    /// A map of the photo's size, row by row.
    pub fn dense(&self, (w, h): (usize, usize)) -> Result<Vec<f32>> {
        let mut out = Vec::new();
        reserve(&mut out, w * h)?;
        let mesh = &self.mesh;
        for y in 0..h {
            let mut ends = [0.0; 2];
            let mut cell = usize::MAX;
            for x in 0..w {
                let p = x as f64 / mesh.spacing;
                let i = (p as usize).min(mesh.columns - 2);
                if i != cell {
                    cell = i;
                    let q = (y as f64 / mesh.spacing).min((mesh.rows - 1) as f64);
                    let j = (q as usize).min(mesh.rows - 2);
                    ends = [i, i + 1].map(|i| {
                        let [a, b] = [j, j + 1].map(|j| self.values[mesh.node(i, j)]);
                        a + (b - a) * (q - j as f64)
                    });
                }
                out.push((ends[0] + (ends[1] - ends[0]) * (p - i as f64)) as f32);
            }
        }
        Ok(out)
    }
}

impl Mesh {
    /// What the samples say; those of a whole cell together weigh 1.
    fn data(&self, samples: &[DepthSample], plane: [f64; 3], parallax: f64, out: &mut Vec<Term>) {
        let per_cell = samples_per_cell(self.spacing);
        out.extend(samples.iter().map(|s| {
            let (nodes, weights) = self.cell(s.point);
            let ratio = (s.parallax / parallax).clamp(0.1, 10.0);
            Term {
                nodes,
                coefficients: weights.map(|w| w * ratio),
                target: (s.depth - plane_depth(plane, s.point)) * parallax * ratio,
                weight: 1.0 / per_cell,
                inverse_scale: 1.0,
            }
        }));
    }

    /// Second differences, and a weak pull to the plane.
    fn smoothness(&self, photo: Option<ImageView<'_>>, out: &mut Vec<Term>) {
        let mut colours = Vec::with_capacity(self.len());
        let side = (0.8 * self.spacing).max(1.0) as usize;
        for y in 0..self.rows {
            for x in 0..self.columns {
                let corner = [x, y].map(|i| i as f64 * self.spacing - 0.5 * side as f64);
                colours.push(mean_colour(photo, corner, side).map(f64::from));
            }
        }
        let alike = |points: &[[usize; 2]]| {
            let mut least: f64 = 1.0;
            for (k, a) in points.iter().enumerate() {
                for b in &points[..k] {
                    let [a, b] = [a, b].map(|[x, y]| colours[y * self.columns + x]);
                    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                    least = least.min(libm::exp(-square / (6.0 * COLOUR * COLOUR)));
                }
            }
            least.max(LEAST_ALIKE)
        };
        let mut push = |points: &[[usize; 2]], coefficients: [f64; 4], weight: f64, inverse_scale: f64| {
            if points.iter().all(|[x, y]| *x < self.columns && *y < self.rows) {
                let mut nodes = [self.node(points[0][0], points[0][1]); 4];
                nodes.iter_mut().zip(points).for_each(|(node, [x, y])| *node = self.node(*x, *y));
                out.push(Term { nodes, coefficients, target: 0.0, weight: weight * BENDING, inverse_scale });
            }
        };
        for y in 0..self.rows {
            for x in 0..self.columns {
                push(&[[x, y]], [1.0, 0.0, 0.0, 0.0], PLANE[1], 0.0);
                for step in [[1, 0], [0, 1]] {
                    let points = [0, 1, 2].map(|k| [x + k * step[0], y + k * step[1]]);
                    if points[1][0] < self.columns && points[1][1] < self.rows {
                        push(&points[..2], [-1.0, 1.0, 0.0, 0.0], PLANE[0] * alike(&points[..2]), 0.0);
                    }
                    if points[2][0] < self.columns && points[2][1] < self.rows {
                        // Those on both sides belong together when neither differs from the one between.
                        let weight = alike(&points[..2]).min(alike(&points[1..]));
                        push(&points, [1.0, -2.0, 1.0, 0.0], weight, 1.0 / CREASE);
                    }
                }
                if x + 1 < self.columns && y + 1 < self.rows {
                    let points = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
                    push(&points, [1.0, -1.0, -1.0, 1.0], 2.0 * alike(&points), 1.0 / CREASE);
                }
            }
        }
    }

    /// Samples along both sides of the segments.
    fn lines(&self, segments: &[LineSegment], (w, h): (usize, usize)) -> Vec<Line> {
        let mut lines = Vec::new();
        for segment in segments {
            let length = segment.length();
            if length < SHORTEST * diagonal((w, h)) {
                continue;
            }
            let [[x, y], [u, v]] = [segment.start, segment.end];
            let (dx, dy) = (u - x, v - y);
            let count = ((2.0 * length / self.spacing) as usize).max(4);
            for side in [-BESIDE, BESIDE] {
                let (mut terms, mut along) = (Vec::new(), Vec::new());
                for k in 0..count {
                    let t = k as f64 / (count - 1) as f64;
                    let point = [x + dx * t - dy / length * side, y + dy * t + dx / length * side];
                    let within = |p: f64, side: usize| p >= 0.0 && p <= (side - 1) as f64;
                    if within(point[0], w) && within(point[1], h) {
                        let (nodes, coefficients) = self.cell(point);
                        terms.push(Term { nodes, coefficients, target: 0.0, weight: LINE, inverse_scale: 1.0 });
                        along.push(t);
                    }
                }
                if terms.len() > 2 {
                    let weights = vec![0.0; terms.len()];
                    lines.push(Line { terms, along, weights });
                }
            }
        }
        lines
    }
}

/// Pixels from one sample to the next, for a photo of this size.
pub(super) fn sample_step(size: (usize, usize)) -> usize {
    ((Mesh::over(size).spacing / 4.0) as usize).max(1)
}

fn samples_per_cell(spacing: f64) -> f64 {
    let step = ((spacing / 4.0) as usize).max(1) as f64;
    (spacing / step) * (spacing / step)
}

impl Line {
    /// Intercept and slope that fit `values` best.
    fn affine(&self, values: &[f64]) -> [f64; 2] {
        let [mut s, mut t, mut tt, mut v, mut tv] = [0.0; 5];
        for ((&w, &a), &value) in self.weights.iter().zip(&self.along).zip(values) {
            (s, t, tt, v, tv) = (s + w, t + w * a, tt + w * a * a, v + w * value, tv + w * a * value);
        }
        let det = s * tt - t * t;
        if det > 1e-12 * s * s { [(tt * v - t * tv) / det, (s * tv - t * v) / det] } else { [v / s, 0.0] }
    }

    fn values(&self, x: &[f64]) -> Vec<f64> {
        self.terms.iter().map(|term| term.value(x)).collect()
    }

    fn reweight(&mut self, x: &[f64], pass: usize) {
        let values = self.values(x);
        if pass == 0 {
            self.weights.iter_mut().for_each(|w| *w = LINE);
            return;
        }
        let [a, b] = self.affine(&values);
        for ((w, value), t) in self.weights.iter_mut().zip(values).zip(&self.along) {
            *w = LINE * robust(value - a - b * t, pass >= ROBUST);
        }
    }

    /// Takes off what the matrix has of this line's terms but should not have: their affine part.
    fn release(&self, x: &[f64], out: &mut [f64]) {
        let [a, b] = self.affine(&self.values(x));
        for ((term, w), t) in self.terms.iter().zip(&self.weights).zip(&self.along) {
            let pull = w * (a + b * t);
            for (&n, c) in term.nodes.iter().zip(term.coefficients) {
                out[n] -= pull * c;
            }
        }
    }
}

/// One reweighted solution.
fn solve(mesh: &Mesh, terms: &[Term], lines: &mut [Line], start: &[f64], pass: usize) -> Result<Option<Vec<f64>>> {
    let mut matrix = Banded::new(mesh.len(), 2 * mesh.columns.min(mesh.rows))?;
    let mut right = vec![0.0; mesh.len()];
    let mut gather = |term: &Term, weight: f64| {
        for (i, (&n, &a)) in term.nodes.iter().zip(&term.coefficients).enumerate() {
            let a = weight * a;
            if a != 0.0 {
                right[n] += a * term.target;
                for (&m, &b) in term.nodes[..=i].iter().zip(&term.coefficients) {
                    matrix.add(n, m, a * b);
                }
            }
        }
    };
    for term in terms {
        let residual = term.residual(start) * term.inverse_scale;
        let share = if pass == 0 || term.inverse_scale == 0.0 { 1.0 } else { robust(residual, pass >= ROBUST) };
        gather(term, term.weight * share);
    }
    for line in lines.iter_mut() {
        line.reweight(start, pass);
        line.terms.iter().zip(&line.weights).for_each(|(term, w)| gather(term, *w));
    }
    let Some(factor) = matrix.clone().cholesky() else { return Ok(None) };
    Ok(Some(conjugate_gradients(&matrix, &factor, lines, right, start)))
}

/// The matrix has the lines pull to 0 rather than to be affine: it only preconditions.
fn conjugate_gradients(matrix: &Banded, factor: &Factor, lines: &[Line], right: Vec<f64>, start: &[f64]) -> Vec<f64> {
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
