//! Chained homographies: each photo's to a root, along the spanning tree and then adjusted together, so that loops close.

use nalgebra::{Matrix2x3, Matrix3, Vector3};

use super::linear::{Equations, times};
use super::{Lens, PairLink};
use crate::geometry::ModelKind;

/// Where the robust cost goes from square to linear, in pixels.
const HUBER: f64 = 1.5;
/// What a match costs whose image is behind the photo, in pixels.
const BEHIND: f64 = 50.0;
const ITERATIONS: usize = 40;
const TOLERANCE: f64 = 1e-6;
/// Most matches of a pair that take part.
const MATCHES: usize = 400;

/// Homographies to a root, in centred coordinates.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub to_root: Vec<Option<Matrix3<f64>>>,
}

/// A pair with the matches that take part, in centred coordinates.
struct Edge {
    photos: [usize; 2],
    matches: Vec<[[f64; 2]; 2]>,
    homography: Matrix3<f64>,
    weight: usize,
}

impl Chain {
    /// Of all photos that pairs connect with the root. A pair with parallax takes part by the homography of the plane that most of
    /// its matches are close to.
    pub fn of(lenses: &[Lens], links: &[PairLink], diagonals: &[f64], root: usize) -> Self {
        let edges: Vec<Edge> = links
            .iter()
            .map(|link| {
                let all = link.centred_matches(lenses);
                let step = all.len().div_ceil(MATCHES).max(1);
                let penalty = if link.kind == ModelKind::TwoView { 2 } else { 1 };
                Edge {
                    photos: link.photos,
                    matches: all.iter().step_by(step).copied().collect(),
                    homography: link.centred(lenses).h,
                    weight: all.len() / penalty,
                }
            })
            .collect();
        let mut chain = Self { to_root: vec![None; lenses.len()] };
        chain.to_root[root] = Some(Matrix3::identity());
        chain.connect(&edges);
        chain.adjust(&edges, diagonals, root);
        chain
    }

    /// Prim's algorithm.
    fn connect(&mut self, edges: &[Edge]) {
        loop {
            let mut best: Option<(usize, usize, Matrix3<f64>)> = None;
            for edge in edges {
                let [a, b] = edge.photos;
                let found = match (self.to_root[a], self.to_root[b]) {
                    (None, Some(to)) => Some((edge.weight, a, times(&to, &edge.homography))),
                    (Some(from), None) => {
                        edge.homography.try_inverse().map(|back| (edge.weight, b, times(&from, &back)))
                    }
                    _ => None,
                };
                if let Some(found) = found
                    && best.is_none_or(|(weight, ..)| found.0 > weight)
                {
                    best = Some(found);
                }
            }
            let Some((_, photo, h)) = best else { return };
            self.to_root[photo] = Some(h / h[(2, 2)]);
        }
    }

    /// From one photo to another; `None` unless both are connected.
    pub fn between(&self, [from, to]: [usize; 2]) -> Option<Matrix3<f64>> {
        Some(times(&self.to_root[to]?.try_inverse()?, &self.to_root[from]?))
    }

    /// Levenberg–Marquardt on the transfer errors of all pairs in both directions.
    fn adjust(&mut self, edges: &[Edge], diagonals: &[f64], root: usize) {
        let mut count = 0;
        let mut offset = |(photo, h): (usize, &Option<Matrix3<f64>>)| {
            (h.is_some() && photo != root).then(|| {
                count += 8;
                count - 8
            })
        };
        let offsets: Vec<Option<usize>> = self.to_root.iter().enumerate().map(&mut offset).collect();
        let problem = Problem { edges, diagonals, offsets, count };
        if problem.count == 0 {
            return;
        }
        let (mut cost, mut equations) = problem.equations(self);
        let (mut damping, mut growth) = (1e-4, 2.0);
        for _ in 0..ITERATIONS {
            let mut damped = equations.clone();
            damped.damp(damping);
            let moved = damped.solve().map(|step| problem.moved(self, &step));
            if let Some(moved) = moved
                && let next = problem.cost(&moved)
                && next < cost
            {
                let small = cost - next <= TOLERANCE * cost;
                *self = moved;
                (cost, equations) = problem.equations(self);
                (damping, growth) = ((damping / 3.0f64).max(1e-10), 2.0);
                if small {
                    break;
                }
            } else {
                damping *= growth;
                growth *= 2.0;
                if damping > 1e12 {
                    break;
                }
            }
        }
    }
}

struct Problem<'a> {
    edges: &'a [Edge],
    diagonals: &'a [f64],
    /// Of each photo's eight unknowns.
    offsets: Vec<Option<usize>>,
    count: usize,
}

/// Huber's cost of a squared error, and its weight.
fn huber(square: f64) -> (f64, f64) {
    let error = square.sqrt();
    if error <= HUBER { (0.5 * square, 1.0) } else { (HUBER * (error - 0.5 * HUBER), HUBER / error) }
}

/// What is called with the photos of a transfer, its map, the point and where it should be.
type Each<'a> = dyn FnMut([usize; 2], &Matrix3<f64>, Vector3<f64>, [f64; 2]) + 'a;

impl Problem<'_> {
    /// Calls `each` with every transfer of a match.
    fn transfers(&self, chain: &Chain, each: &mut Each<'_>) {
        for edge in self.edges {
            let [a, b] = edge.photos;
            let (Some(forth), Some(back)) = (chain.between([a, b]), chain.between([b, a])) else { continue };
            for [from, to] in &edge.matches {
                each([a, b], &forth, Vector3::new(from[0], from[1], 1.0), *to);
                each([b, a], &back, Vector3::new(to[0], to[1], 1.0), *from);
            }
        }
    }

    fn cost(&self, chain: &Chain) -> f64 {
        let mut sum = 0.0;
        self.transfers(chain, &mut |[_, to], map, point, place| {
            let p = map * point;
            let unit = self.diagonals[to];
            let square = (p[0] / p[2] - place[0]).powi(2) + (p[1] / p[2] - place[1]).powi(2);
            let square = if p[2] > 0.0 { unit * unit * square } else { BEHIND * BEHIND };
            sum += huber(square).0;
        });
        sum
    }

    /// The cost, and the equations of a step against the gradient.
    fn equations(&self, chain: &Chain) -> (f64, Equations) {
        let (mut cost, mut equations) = (0.0, Equations::zeros(self.count));
        self.transfers(chain, &mut |[from, to], map, point, place| {
            let p = map * point;
            if p[2].is_nan() || p[2] <= 0.0 {
                cost += huber(BEHIND * BEHIND).0;
                return;
            }
            let scale = self.diagonals[to] / p[2];
            let error = [0, 1].map(|k| self.diagonals[to] * (p[k] / p[2] - place[k]));
            let (part, weight) = huber(error[0] * error[0] + error[1] * error[1]);
            cost += part;
            let slope = Matrix2x3::new(1.0, 0.0, -p[0] / p[2], 0.0, 1.0, -p[1] / p[2]) * scale;
            // H ← H (I + Δ) of either photo, but for the last entry of Δ.
            let mut slots: [(usize, [f64; 2]); 16] = [(0, [0.0; 2]); 16];
            let mut used = 0;
            let ends = [(from, slope * map, point), (to, -slope, p)];
            for (photo, slope, v) in ends {
                let Some(at) = self.offsets[photo] else { continue };
                for i in 0..8 {
                    let (row, column) = (i / 3, i % 3);
                    slots[used] = (at + i, [slope[(0, row)] * v[column], slope[(1, row)] * v[column]]);
                    used += 1;
                }
            }
            for (k, error) in error.iter().enumerate() {
                for (a, (at, slopes)) in slots[..used].iter().enumerate() {
                    equations.right[*at] += weight * slopes[k] * error;
                    for (other, second) in &slots[..=a] {
                        equations.add(*at, *other, weight * slopes[k] * second[k]);
                    }
                }
            }
        });
        (cost, equations)
    }

    fn moved(&self, chain: &Chain, step: &[f64]) -> Chain {
        let mut moved = chain.clone();
        for (h, offset) in moved.to_root.iter_mut().zip(&self.offsets) {
            if let (Some(h), Some(at)) = (h, *offset) {
                let delta = Matrix3::from_fn(|r, c| if r + c < 4 { -step[at + 3 * r + c] } else { 0.0 });
                *h = times(h, &(Matrix3::identity() + delta));
                *h /= h[(2, 2)];
            }
        }
        moved
    }
}
