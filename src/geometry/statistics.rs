//! Whether a consensus is more than chance.

/// Logarithm of the binomial coefficient.
fn ln_choose(n: f64, k: f64) -> f64 {
    libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0)
}

/// ln 10⁻³: one false alarm in a thousand pairs of photos that have nothing in common.
const ALARMS: f64 = -6.907755278982137;

/// The least number of inliers, of `n` matches, that chance is not expected to bring about (a-contrario, Moisan & Stival
/// 2004): the smallest k whose number of false alarms
/// C(n, m)·P(Bin(n − m, p) ≥ k − m) is below 10⁻³, for a model fixed by `m` matches and a chance `p` that a
/// random match falls within the threshold. More than `n` when even full agreement proves nothing.
pub(super) fn meaningful_consensus(n: usize, m: usize, p: f64) -> usize {
    let (trials, m_f) = ((n - m) as f64, m as f64);
    let samples = ln_choose(n as f64, m_f);
    (m + 1..=n)
        .find(|&k| {
            let hits = (k - m) as f64;
            let tail = regularised_beta(hits, trials - hits + 1.0, p);
            samples + libm::log(tail.max(f64::MIN_POSITIVE)) < ALARMS
        })
        .unwrap_or(n + 1)
}

/// Regularised incomplete beta function I_x(a, b), by Lentz's continued fraction (Numerical Recipes, 6.4).
fn regularised_beta(a: f64, b: f64, x: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front =
        libm::exp(libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * libm::log(x) + b * libm::log1p(-x));
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - front * beta_fraction(b, a, 1.0 - x) / b;
    }
    front * beta_fraction(a, b, x) / a
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut h = d;
    for i in 1..300 {
        let m = f64::from(i);
        for step in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / guard(1.0 + step * d);
            c = guard(1.0 + step / c);
            h *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-14 {
            break;
        }
    }
    h
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
