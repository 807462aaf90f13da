//! Order statistics, and whether a consensus is more than chance.

/// Sorts numbers. The one place that does: every further instantiation of the standard library's sort is kilobytes.
#[inline(never)]
pub(super) fn sort(values: &mut [f64]) {
    values.sort_unstable_by(f64::total_cmp);
}

/// The upper median; `None` of no values.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    sort(&mut values);
    values.get(values.len() / 2).copied()
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

/// The least number of inliers, of `n` matches, that chance is not expected to bring about (a-contrario, Moisan & Stival
/// 2004): the smallest k whose number of false alarms
/// C(n, m)·P(Bin(n − m, p) ≥ k − m) is below 10⁻³, for a model fixed by `m` matches and a chance `p` that a
/// random match falls within the threshold. More than `n` when even full agreement proves nothing.
pub(super) fn meaningful_consensus(n: usize, m: usize, p: f64) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, term by term.
    fn alarms(n: usize, m: usize, k: usize, p: f64) -> f64 {
        let choose = |n: usize, k: usize| (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product::<f64>();
        let term = |j: usize| choose(n - m, j) * p.powi(j as i32) * (1.0 - p).powi((n - m - j) as i32);
        choose(n, m) * (k - m..=n - m).map(term).sum::<f64>()
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
