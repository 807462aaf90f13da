//! Order statistics, and whether a consensus is more than chance.

/// The median of a Rayleigh variable, the length of a vector whose two coordinates have standard deviation 1: √(2 ln 2).
pub(crate) const RAYLEIGH_MEDIAN: f64 = 1.177;
/// The median of the absolute value of a normal variable of standard deviation 1.
pub(crate) const NORMAL_MEDIAN: f64 = 0.6745;
/// The median of a χ² variable with one degree of freedom.
pub(crate) const CHI_SQUARED_MEDIAN: f64 = 0.455;

/// The upper median; `None` of no values.
pub(crate) fn median(values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    nth(values, middle)
}

/// The value with `middle` others before it in ascending order; `None` if there are not so many. By Hoare's selection: an
/// instantiation of the standard library's sort would be several kilobytes of wasm.
pub(crate) fn nth(mut values: Vec<f64>, middle: usize) -> Option<f64> {
    let (mut low, mut high) = (0, values.len().checked_sub(1)?);
    while low < high {
        let pivot = values[low + (high - low) / 2];
        let (mut i, mut j) = (low, high);
        loop {
            while values[i].total_cmp(&pivot).is_lt() {
                i += 1;
            }
            while values[j].total_cmp(&pivot).is_gt() {
                j -= 1;
            }
            if i >= j {
                break;
            }
            values.swap(i, j);
            (i, j) = (i + 1, j - 1);
        }
        // All up to j are at most the pivot, all from j + 1 at least.
        (low, high) = if middle <= j { (low, j) } else { (j + 1, high) };
    }
    values.get(middle).copied()
}

/// ln 0!, ln 1!, … ln n!
fn ln_factorials(n: usize) -> Vec<f64> {
    let mut sum = 0.0;
    let ln = |k: usize| {
        sum += libm::log(k.max(1) as f64);
        sum
    };
    (0..=n).map(ln).collect()
}

/// ln 10⁻³: one false alarm in a thousand pairs of photos that have nothing in common.
const ALARMS: f64 = -6.907755278982137;

/// The smallest number of inliers, of `n` matches, that cannot be expected by chance (a-contrario, Moisan & Stival
/// 2004): the smallest k whose number of false alarms
/// C(n, m)·P(Bin(n − m, p) ≥ k − m) is below 10⁻³, for a model determined by `m` matches and a chance `p` that a
/// random match falls within the threshold. More than `n` when even full agreement proves nothing.
pub(crate) fn meaningful_consensus(n: usize, m: usize, p: f64) -> usize {
    let ln = ln_factorials(n);
    let ln_choose = |n: usize, k: usize| ln[n] - ln[k] - ln[n - k];
    let trials = n - m;
    let (ln_hit, ln_miss) = (libm::log(p), libm::log1p(-p));
    // From full agreement downwards, so that the tail is a running sum.
    let mut tail = 0.0;
    let mut least = n + 1;
    for hits in (1..=trials).rev() {
        let miss = if hits == trials { 0.0 } else { (trials - hits) as f64 * ln_miss };
        tail += libm::exp(ln_choose(trials, hits) + hits as f64 * ln_hit + miss);
        if ln_choose(n, m) + libm::log(tail.max(f64::MIN_POSITIVE)) >= ALARMS {
            break;
        }
        least = hits + m;
    }
    least
}

/// At most so many of the values, from all over the list.
pub(crate) fn evenly_chosen<T>(values: &[T], most: usize) -> impl Iterator<Item = &T> {
    let count = values.len().min(most);
    (0..count).filter_map(move |i| values.get(i * values.len() / count))
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// The definition, term by term.
    fn alarms(n: usize, m: usize, k: usize, p: f64) -> f64 {
        let choose = |n: usize, k: usize| (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product::<f64>();
        let term = |j: usize| choose(n - m, j) * p.powi(j as i32) * (1.0 - p).powi((n - m - j) as i32);
        choose(n, m) * (k - m..=n - m).map(term).sum::<f64>()
    }

    #[test]
    fn median_is_that_of_the_sorted() {
        let mut state = 1u64;
        for n in 1..60 {
            for kinds in [2, 7, 1000] {
                let mut next = || {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    ((state >> 33) % kinds) as f64
                };
                let values: Vec<f64> = (0..n).map(|_| next()).collect();
                let mut sorted = values.clone();
                sorted.sort_by(f64::total_cmp);
                assert_eq!(median(values), Some(sorted[n / 2]));
            }
        }
        assert_eq!(median(Vec::new()), None);
    }

    #[test]
    fn consensus_is_the_least_that_chance_does_not_explain() {
        for (n, m, p) in [(7, 6, 1e-4), (20, 6, 1e-3), (60, 6, 0.01), (100, 4, 0.05), (400, 6, 0.02), (30, 4, 0.2)] {
            let k = meaningful_consensus(n, m, p);
            assert!(k > m && k <= n, "{n} {m} {p}: {k}");
            assert!(alarms(n, m, k, p) < 1e-3);
            assert!(k == m + 1 || alarms(n, m, k - 1, p) >= 1e-3);
        }
        assert_eq!(meaningful_consensus(10, 6, 0.5), 11);
    }
}
