//! Chained homographies: each photo's to a root, along the spanning tree and then adjusted together, so that loops close.

use nalgebra::{DVector, Matrix2x3, Matrix3, Vector3};

use super::least_squares::{Equations, huber};
use super::spanning_tree::spanning_tree;
use super::{Lens, PairLink};
use crate::geometry::ModelKind;
use crate::geometry::levenberg_marquardt::{LeastSquares, minimise};

/// Most iterations, and where they stop: when a step reduces the cost by less than this fraction.
const ITERATIONS: usize = 40;
const TOLERANCE: f64 = 1e-6;
/// Most matches of a pair that take part, and of all pairs together.
const MATCHES: usize = 400;
const ALL_MATCHES: usize = 24_000;

/// Homographies to a root, in centred coordinates, of norm 1: the sign says what is in front of the root's camera, and an entry may be
/// nothing or negative, as a photo's centre may be beside or behind it.
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
        let most = (ALL_MATCHES / links.len().max(1)).clamp(1, MATCHES);
        let edges: Vec<Edge> = links
            .iter()
            .map(|link| {
                let all = link.centred_matches(lenses);
                let step = all.len().div_ceil(most).max(1);
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
        chain.connect(&edges, root);
        chain.adjust(&edges, diagonals, root);
        chain
    }

    /// Along the spanning tree of the pairs with most matches.
    fn connect(&mut self, edges: &[Edge], root: usize) {
        let pairs: Vec<_> = edges.iter().map(|edge| (edge.photos, edge.weight as f64)).collect();
        self.to_root[root] = Some(Matrix3::identity());
        for (pair, added) in spanning_tree(&pairs, self.to_root.len(), root) {
            let Edge { photos, homography, .. } = &edges[pair];
            let step = if added == 0 { Some(*homography) } else { homography.try_inverse() };
            let h = self.to_root[photos[1 - added]].zip(step).map(|(known, step)| known * step);
            self.to_root[photos[added]] = h.map(|h| h / h.norm());
        }
    }

    /// From one photo to another; `None` unless both are connected.
    pub fn between(&self, [from, to]: [usize; 2]) -> Option<Matrix3<f64>> {
        Some(self.to_root[to]?.try_inverse()? * self.to_root[from]?)
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
        let problem = TransferErrors { edges, diagonals, offsets, count };
        if problem.count > 0 {
            *self = minimise(&problem, self.clone(), TOLERANCE, ITERATIONS).0;
        }
    }
}

/// The robust transfer errors of all pairs in both directions.
struct TransferErrors<'a> {
    edges: &'a [Edge],
    diagonals: &'a [f64],
    /// Of each photo's eight unknowns.
    offsets: Vec<Option<usize>>,
    count: usize,
}

impl TransferErrors<'_> {
    /// Adds those of matches from one photo to another.
    fn add(&self, equations: &mut Equations, [from, to]: [usize; 2], map: &Matrix3<f64>, matches: &[[[f64; 2]; 2]]) {
        for [source, target] in matches {
            let (point, diagonal) = (Vector3::new(source[0], source[1], 1.0), self.diagonals[to]);
            let p = map * point;
            let error = (p[2] > 0.0).then(|| [0, 1].map(|k| diagonal * (p[k] / p[2] - target[k])));
            let (cost, weight) = huber(error, 1.0);
            equations.cost += cost;
            let Some(error) = error else { continue };
            let slope = Matrix2x3::new(1.0, 0.0, -p[0] / p[2], 0.0, 1.0, -p[1] / p[2]) * (diagonal / p[2]);
            // H ← H (I + Δ) of either photo, but for the last entry of Δ.
            let mut slots: [(usize, [f64; 2]); 16] = [(0, [0.0; 2]); 16];
            let mut used = 0;
            for (photo, slope, v) in [(from, slope * map, point), (to, -slope, p)] {
                let Some(at) = self.offsets[photo] else { continue };
                for i in 0..8 {
                    let (row, column) = (i / 3, i % 3);
                    slots[used] = (at + i, [slope[(0, row)] * v[column], slope[(1, row)] * v[column]]);
                    used += 1;
                }
            }
            equations.add_residual(&slots[..used], error, weight);
        }
    }
}

impl LeastSquares for TransferErrors<'_> {
    type State = Chain;
    type Equations = Equations;

    fn normal_equations(&self, chain: &Chain) -> Equations {
        let mut equations = Equations::zeros(self.count);
        for edge in self.edges {
            let [a, b] = edge.photos;
            let (Some(forth), Some(back)) = (chain.between([a, b]), chain.between([b, a])) else { continue };
            let reversed: Vec<_> = edge.matches.iter().map(|[from, to]| [*to, *from]).collect();
            self.add(&mut equations, [a, b], &forth, &edge.matches);
            self.add(&mut equations, [b, a], &back, &reversed);
        }
        equations
    }

    fn moved(&self, chain: &Chain, step: &DVector<f64>) -> Chain {
        let mut moved = chain.clone();
        for (h, offset) in moved.to_root.iter_mut().zip(&self.offsets) {
            if let (Some(h), Some(at)) = (h, *offset) {
                let delta = Matrix3::from_fn(|r, c| if r + c < 4 { step[at + 3 * r + c] } else { 0.0 });
                *h *= Matrix3::identity() + delta;
                *h /= h.norm();
            }
        }
        moved
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Rotation3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::{Match, Model};
    use crate::rect::diagonal;

    #[test]
    fn photos_on_either_side_of_a_right_angle_are_chained() {
        let lens = Lens { size: (800, 600), focal: Some(700.0) };
        let [k, back] = lens.calibration(700.0 / diagonal(lens.size));
        // 0, 20, 40 ... degrees: the centre of the fifth one is in front of the first camera, that of the sixth behind it.
        let turn = *Rotation3::from_euler_angles(0.0, -20f64.to_radians(), 0.0).matrix();
        let h = k * turn * back;
        let links: Vec<PairLink> = (0..6)
            .map(|photo| {
                let at = |x: f64, y: f64| {
                    let p = h * Vector3::new(x, y, 1.0);
                    Match { target: [x, y], reference: [p[0] / p[2], p[1] / p[2]] }
                };
                let all = (0..200).map(|i| at(f64::from(i * 97 % 800), f64::from(i * 61 % 600)));
                let matches: Vec<Match> = all.filter(|m| (0.0..800.0).contains(&m.reference[0])).collect();
                let features = (0..matches.len()).map(|i| [i as u32; 2]).collect();
                let kind = ModelKind::Homography;
                PairLink { photos: [photo, photo + 1], features, matches, model: Model::homography(h), kind }
            })
            .collect();
        let lenses = [lens; 7];
        let chain = Chain::of(&lenses, &links, &[diagonal(lens.size); 7], 0);
        for link in &links {
            let map = chain.between(link.photos).unwrap();
            for [from, to] in link.centred_matches(&lenses) {
                let p = map * Vector3::new(from[0], from[1], 1.0);
                let error = (p[0] / p[2] - to[0]).hypot(p[1] / p[2] - to[1]);
                assert!(p[2] > 0.0 && error < 1e-6, "{:?}: {p:?}, {error}", link.photos);
            }
        }
    }
}
