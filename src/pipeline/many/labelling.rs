//! Labels on a grid by min-sum belief propagation (Felzenszwalb & Huttenlocher, *Efficient Belief Propagation for Early Vision*,
//! 2006): the least sum of what labels cost and of what neighbours with different ones do.

use crate::Result;
use crate::image::filled;

/// Passes in all four directions.
const PASSES: usize = 6;

/// What to label.
pub(super) struct Labelling {
    pub columns: usize,
    pub rows: usize,
    /// How many labels there are.
    pub labels: usize,
    /// Of each node, row by row, what each label costs.
    pub costs: Vec<f32>,
}

impl Labelling {
    /// The label of every node. `apart` says what it costs that two labels meet between neighbouring nodes, the first of which is the left
    /// or the upper one.
    pub fn solve(&self, apart: &dyn Fn([usize; 2], [usize; 2]) -> f32) -> Result<Vec<usize>> {
        let (nodes, count) = (self.columns * self.rows, self.labels);
        // Between each node and the next to the right, and below it.
        let mut meeting = filled(2 * nodes * count * count, 0.0f32)?;
        for (i, cost) in meeting.iter_mut().enumerate() {
            let (edge, pair) = (i / (count * count), i % (count * count));
            let next = edge / 2 + if edge % 2 == 0 { 1 } else { self.columns };
            *cost = apart([edge / 2, next], [pair / count, pair % count]);
        }
        // What comes from the left, from the right, from above and from below.
        let mut messages = filled(4 * nodes * count, 0.0f32)?;
        let mut belief = filled(count, 0.0f32)?;
        for direction in [0, 1, 2, 3].repeat(PASSES) {
            for i in 0..nodes {
                let backwards = direction % 2 == 1;
                let node = if backwards { nodes - 1 - i } else { i };
                let (column, row) = (node % self.columns, node / self.columns);
                let to = match direction {
                    0 if column + 1 < self.columns => node + 1,
                    1 if column > 0 => node - 1,
                    2 if row + 1 < self.rows => node + self.columns,
                    3 if row > 0 => node - self.columns,
                    _ => continue,
                };
                for (label, belief) in belief.iter_mut().enumerate() {
                    let others = (0..4).filter(|from| *from != direction ^ 1);
                    let heard: f32 = others.map(|from| messages[(4 * node + from) * count + label]).sum();
                    *belief = self.costs[node * count + label] + heard;
                }
                let edge = (2 * node.min(to) + direction / 2) * count * count;
                let mut least = f32::INFINITY;
                for label in 0..count {
                    let through = |(own, belief): (usize, &f32)| {
                        belief + meeting[edge + if backwards { label * count + own } else { own * count + label }]
                    };
                    let best = belief.iter().enumerate().map(through).fold(f32::INFINITY, f32::min);
                    messages[(4 * to + direction) * count + label] = best;
                    least = least.min(best);
                }
                let told = (4 * to + direction) * count;
                messages[told..told + count].iter_mut().for_each(|message| *message -= least);
            }
        }
        let best = |node: usize| {
            let total = |label: usize| -> f32 {
                let heard: f32 = (0..4).map(|from| messages[(4 * node + from) * count + label]).sum();
                self.costs[node * count + label] + heard
            };
            (0..count).min_by(|a, b| total(*a).total_cmp(&total(*b))).unwrap_or(0)
        };
        Ok((0..nodes).map(best).collect())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// Two halves that are known at their outer ends only: the border is where it costs least, not where the ends would put it.
    #[test]
    fn labels_spread_to_where_it_is_cheap_to_change() {
        let (columns, rows) = (20, 7);
        let mut costs = vec![0.0; columns * rows * 2];
        for row in 0..rows {
            costs[row * columns * 2 + 1] = 9.0;
            costs[(row * columns + columns - 1) * 2] = 9.0;
        }
        let labelling = Labelling { columns, rows, labels: 2, costs };
        let apart = |[from, to]: [usize; 2], [a, b]: [usize; 2]| {
            let cheap = to == from + 1 && from % columns == 4;
            if a == b {
                0.0
            } else if cheap {
                0.5
            } else {
                1.0
            }
        };
        let labels = labelling.solve(&apart).unwrap();
        for (node, label) in labels.into_iter().enumerate() {
            assert_eq!(label, usize::from(node % columns > 4), "node {node}");
        }
    }
}
