//! Which pairs carry what is known of one photo on to all others.

/// The pairs of the heaviest spanning tree of what is connected with `root`, from there outwards, and which of a pair's photos it adds, 0 or 1:
/// Prim's algorithm. Of equally heavy pairs the first is taken.
pub(super) fn spanning_tree(pairs: &[([usize; 2], f64)], photos: usize, root: usize) -> Vec<(usize, usize)> {
    let mut reached = vec![false; photos];
    reached[root] = true;
    let mut tree = Vec::new();
    loop {
        let mut best: Option<(usize, f64)> = None;
        for (i, &([a, b], weight)) in pairs.iter().enumerate() {
            if reached[a] != reached[b] && best.is_none_or(|(_, most)| weight > most) {
                best = Some((i, weight));
            }
        }
        let Some((pair, _)) = best else { return tree };
        let added = usize::from(reached[pairs[pair].0[0]]);
        reached[pairs[pair].0[added]] = true;
        tree.push((pair, added));
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn the_heaviest_pairs_reach_all_that_are_connected() {
        let pairs = [([0, 1], 1.0), ([2, 1], 5.0), ([0, 2], 3.0), ([3, 4], 9.0)];
        assert_eq!(spanning_tree(&pairs, 5, 0), [(2, 1), (1, 1)]);
        assert_eq!(spanning_tree(&pairs, 5, 1), [(1, 0), (2, 0)]);
    }
}
