//! The mesh, and what its values should fulfil.

use super::{OtherView, outside};
use crate::ImageView;
use crate::depth::interpolation::mean_colour;
use crate::geometry::plane_depth;
use crate::rect::diagonal;

// Tuned on the evaluation cases: half and twice of each change PSNR and coverage by less than 1 % where nothing else is said.

/// Cells along the photo's longer side: 20 cost 2.3 % of PSNR; 80 gain 1.4 %, but bend what only the target shows by 12 % more.
const CELLS: usize = 40;
/// Weight of a second difference between vertices, next to the samples of a whole cell: at 2 the outside bends 6 % more, at 8
/// colours at the seam differ by 6 % more.
const BENDING: f64 = 4.0;
/// Colours that differ by this much, in levels over three channels, lower it to 1/√e: 28 cost 2 % of PSNR, at 7 what only the
/// target shows bends 6 % more.
const COLOUR: f64 = 14.0;
/// But to no less than this share.
const LEAST_ALIKE: f64 = 0.01;
/// Pull to the background, where nothing else is known: of slopes and of values, as shares of the bending's weight.
const BACKGROUND: [f64; 2] = [3e-3, 1e-6];
/// The same of values far outside the other photo, and less before, so that both photos still agree near the border. Tuned on the
/// evaluation cases: at 0.001 things still lean, at 0.01 they are squeezed.
const FAR_OUTSIDE: f64 = 0.004;
/// The same of slopes straight out from the other photo's border, soon outside. Of 13 pairs of real photos whose overlap was
/// partly hidden, eight times as much displaces what is hidden by 1 % more.
const OUTWARD: f64 = 2.5;
const SOON: f64 = 0.03;
/// How far that is, as a share of the other photo's diagonal: half bends the outside 8 % less, twice 12 % more.
const FAR: f64 = 0.08;

/// Vertices at regular distances.
#[derive(Clone, Copy)]
pub(super) struct Mesh {
    pub spacing: f64,
    pub columns: usize,
    pub rows: usize,
}

/// A linear residual: the sum of `coefficients` times the values of `nodes`, less `target`.
#[derive(Clone, Copy)]
pub(super) struct Term {
    pub nodes: [usize; 4],
    pub coefficients: [f64; 4],
    pub target: f64,
    pub weight: f64,
}

impl Term {
    pub fn value(&self, x: &[f64]) -> f64 {
        self.nodes.iter().zip(self.coefficients).map(|(&n, c)| c * x[n]).sum()
    }

    pub fn residual(&self, x: &[f64]) -> f64 {
        self.value(x) - self.target
    }
}

impl Mesh {
    pub fn over((w, h): (usize, usize)) -> Self {
        let spacing = ((w.max(h) - 1) as f64 / CELLS as f64).max(1.0);
        let count = |side: usize| ((side - 1) as f64 / spacing).ceil() as usize + 1;
        Self { spacing, columns: count(w).max(2), rows: count(h).max(2) }
    }

    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Numbered along the shorter side, so that neighbours' numbers are close.
    pub fn node(&self, x: usize, y: usize) -> usize {
        if self.columns >= self.rows { x * self.rows + y } else { y * self.columns + x }
    }

    /// All vertices with their points.
    pub fn vertices(&self) -> impl Iterator<Item = (usize, [f64; 2])> + '_ {
        let point = |x: usize, y: usize| [x, y].map(|i| i as f64 * self.spacing);
        (0..self.rows).flat_map(move |y| (0..self.columns).map(move |x| (self.node(x, y), point(x, y))))
    }

    /// The vertices around a point, and their weights.
    pub fn cell(&self, [x, y]: [f64; 2]) -> ([usize; 4], [f64; 4]) {
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

    /// Pixels from one sample to the next.
    pub fn sample_step(&self) -> usize {
        ((self.spacing / 4.0) as usize).max(1)
    }

    /// What one sample weighs if they are [`Self::sample_step`] apart: those of a whole cell together weigh 1.
    pub fn sample_weight(&self) -> f64 {
        let per_side = self.spacing / self.sample_step() as f64;
        1.0 / (per_side * per_side)
    }

    /// Second differences, and a weak pull of slopes to the background.
    pub fn smoothness(&self, photo: Option<ImageView<'_>>) -> Vec<Term> {
        let mut out = Vec::with_capacity(5 * self.len());
        let mut colours = Vec::with_capacity(self.len());
        let side = (0.8 * self.spacing).max(1.0) as usize;
        for y in 0..self.rows {
            for x in 0..self.columns {
                let corner = [x, y].map(|i| i as f64 * self.spacing - 0.5 * side as f64);
                colours.push(mean_colour(photo, corner, side).map(f64::from));
            }
        }
        let similarity = |points: &[[usize; 2]]| {
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
        let mut push = |points: &[[usize; 2]], coefficients: [f64; 4], weight: f64| {
            if points.iter().all(|[x, y]| *x < self.columns && *y < self.rows) {
                let mut nodes = [self.node(points[0][0], points[0][1]); 4];
                nodes.iter_mut().zip(points).for_each(|(node, [x, y])| *node = self.node(*x, *y));
                out.push(Term { nodes, coefficients, target: 0.0, weight: weight * BENDING });
            }
        };
        for y in 0..self.rows {
            for x in 0..self.columns {
                for step in [[1, 0], [0, 1]] {
                    let points = [0, 1, 2].map(|k| [x + k * step[0], y + k * step[1]]);
                    if points[1][0] < self.columns && points[1][1] < self.rows {
                        push(&points[..2], [-1.0, 1.0, 0.0, 0.0], BACKGROUND[0] * similarity(&points[..2]));
                    }
                    if points[2][0] < self.columns && points[2][1] < self.rows {
                        // Those on both sides belong together when neither differs from the one between.
                        let weight = similarity(&points[..2]).min(similarity(&points[1..]));
                        push(&points, [1.0, -2.0, 1.0, 0.0], weight);
                    }
                }
                if x + 1 < self.columns && y + 1 < self.rows {
                    let points = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
                    push(&points, [1.0, -1.0, -1.0, 1.0], 2.0 * similarity(&points));
                }
            }
        }
        out
    }

    /// Pull of the values to the background: of all of them weakly. With `far`, those that land outside of that photo are pulled more, to the plane
    /// given. `depth` is what the vertices have now.
    pub fn pull(
        &self,
        depth: &dyn Fn(usize, [f64; 2]) -> f64,
        far: Option<(&OtherView<'_>, [f64; 3])>,
        out: &mut Vec<Term>,
    ) {
        out.extend(self.vertices().map(|(node, point)| {
            let share = far.map_or(0.0, |(other, _)| {
                let distance = other.distance(point, depth(node, point));
                let share = (distance / (FAR * diagonal(other.size))).min(1.0);
                share * share
            });
            Term {
                nodes: [node; 4],
                coefficients: [1.0, 0.0, 0.0, 0.0],
                target: far.filter(|_| share > 0.0).map_or(0.0, |(_, goal)| plane_depth(goal, point)),
                weight: BENDING * (BACKGROUND[1] + FAR_OUTSIDE * share),
            }
        }));
    }

    /// Pull of the slopes to those given, of the values along x and y, per pixel: as far as an edge of the mesh leads away from the `other` photo
    /// where it lands outside of it. `depth` is about what a point has.
    pub fn pull_slopes(
        &self,
        depth: &dyn Fn([f64; 2]) -> f64,
        other: &OtherView<'_>,
        slopes: [f64; 2],
        out: &mut Vec<Term>,
    ) {
        let landing = |[x, y]: [f64; 2]| other.model.project(x, y, depth([x, y]));
        for (from, point) in self.vertices() {
            for axis in [0, 1] {
                let mut next = point;
                next[axis] += self.spacing;
                let [x, y] = next.map(|p| (p / self.spacing).round() as usize);
                if x >= self.columns || y >= self.rows {
                    continue;
                }
                let Some((a, b)) = landing(point).zip(landing(next)) else { continue };
                let [near, far] = [a, b].map(|place| outside(place, other.size));
                let cosine = (far - near) / ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
                let share = (near.max(far) / (SOON * diagonal(other.size))).min(1.0) * cosine;
                if share.abs() > 0.0 {
                    let to = self.node(x, y);
                    out.push(Term {
                        nodes: [from, to, from, from],
                        coefficients: [-1.0, 1.0, 0.0, 0.0],
                        target: slopes[axis] * self.spacing,
                        weight: BENDING * OUTWARD * share * share,
                    });
                }
            }
        }
    }
}
