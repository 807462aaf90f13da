//! Rectangles, and the number of false alarms that decides whether one is a line segment (sections 2.7 and 2.8 of the paper).

use std::f64::consts::{LN_10, PI};

use super::level_lines::LevelLines;

/// Rectangles tried of each place: the tests of one segment are counted as these.
const TRIALS: f64 = 11.0;
/// Steps of each variation of a rectangle that is not yet significant.
const STEPS: usize = 5;

/// In pixels of the reduced photo.
#[derive(Clone, Copy)]
pub(super) struct Rectangle {
    /// Ends of the middle line.
    pub start: [f64; 2],
    pub end: [f64; 2],
    /// Unit vector from start to end.
    pub direction: [f64; 2],
    pub width: f64,
    /// Chance that a pixel of noise is aligned with it: the angle tolerance over π.
    pub probability: f64,
}

impl Rectangle {
    pub fn length(&self) -> f64 {
        let [x, y] = [self.end[0] - self.start[0], self.end[1] - self.start[1]];
        (x * x + y * y).sqrt().max(1.0)
    }

    /// A step of a variation; `None` where there is none left.
    fn varied(&self, variation: Variation) -> Option<Self> {
        match variation {
            Variation::Finer => Some(Self { probability: 0.5 * self.probability, ..*self }),
            Variation::Narrower(shift) => {
                let [x, y] = self.direction;
                let moved = |[a, b]: [f64; 2]| [a - y * shift, b + x * shift];
                let width = self.width - 0.5;
                (width >= 0.5).then(|| Self { start: moved(self.start), end: moved(self.end), width, ..*self })
            }
        }
    }
}

/// How a rectangle that is not yet significant is varied.
#[derive(Clone, Copy)]
enum Variation {
    /// Half the angle tolerance.
    Finer,
    /// Half a pixel narrower, the middle line so many pixels farther to the right of its direction.
    Narrower(f64),
}

/// The a-contrario test of rectangles.
pub(super) struct Validation<'a> {
    lines: &'a LevelLines,
    /// log₁₀ of the number of tests.
    tests: f64,
    probability: f64,
    least: f64,
}

impl<'a> Validation<'a> {
    pub fn new(lines: &'a LevelLines, probability: f64, least: f64) -> Self {
        let tests = 2.5 * (libm::log10(lines.width as f64) + libm::log10(lines.height as f64)) + libm::log10(TRIALS);
        Self { lines, tests, probability, least }
    }

    /// Fewer could not be significant even if all were aligned.
    pub fn least_pixels(&self) -> usize {
        ((self.tests + self.least) / -libm::log10(self.probability)).max(2.0) as usize
    }

    /// The rectangle with its −log₁₀ NFA if that is enough, or the first of its variations for which it is.
    pub fn validate(&self, rectangle: Rectangle) -> Option<(Rectangle, f64)> {
        let variations = [
            Variation::Finer,
            Variation::Narrower(0.0),
            Variation::Narrower(0.25),
            Variation::Narrower(-0.25),
            Variation::Finer,
        ];
        let mut best = (rectangle, self.significance(&rectangle));
        for variation in variations {
            if best.1 > self.least {
                break;
            }
            let mut candidate = best.0;
            for _ in 0..STEPS {
                let Some(next) = candidate.varied(variation) else { break };
                candidate = next;
                let significance = self.significance(&candidate);
                if significance > best.1 {
                    best = (candidate, significance);
                }
            }
        }
        (best.1 > self.least).then_some(best)
    }

    /// −log₁₀ of the number of false alarms.
    fn significance(&self, rectangle: &Rectangle) -> f64 {
        let (pixels, aligned) = self.count(rectangle);
        -log10_binomial_tail(pixels, aligned, rectangle.probability) - self.tests
    }

    /// How many pixels have their centre in the rectangle, and how many of them are aligned with it.
    fn count(&self, rectangle: &Rectangle) -> (usize, usize) {
        // Pixels at the end of the region lie on the rectangle's border but for rounding.
        const MARGIN: f64 = 1e-6;
        let ([x0, y0], [dx, dy]) = (rectangle.start, rectangle.direction);
        let (length, half) = (rectangle.length() + MARGIN, 0.5 * rectangle.width + MARGIN);
        let aside = half * dx.abs();
        let top = (y0.min(rectangle.end[1]) - aside).ceil().max(0.0) as usize;
        let bottom = (y0.max(rectangle.end[1]) + aside).floor().min((self.lines.height - 1) as f64);
        let least = libm::cos(rectangle.probability * PI);
        let (mut pixels, mut aligned) = (0, 0);
        for y in top..(bottom + 1.0).max(0.0) as usize {
            let fall = y as f64 - y0;
            // The row's part within both pairs of parallel sides.
            let (a, b) = slab(dx, fall * dy, -MARGIN, length);
            let (c, d) = slab(-dy, fall * dx, -half, half);
            let left = (x0 + a.max(c)).ceil().max(0.0);
            let right = (x0 + b.min(d)).floor().min((self.lines.width - 1) as f64);
            if left > right {
                continue;
            }
            let row = &self.lines.directions[y * self.lines.width..][left as usize..=right as usize];
            pixels += row.len();
            aligned += row
                .iter()
                .map(|&[u, v]| f64::from(u) * dx + f64::from(v) * dy)
                .filter(|&along| along > 0.0 && along >= least)
                .count();
        }
        (pixels, aligned)
    }
}

/// The interval of x where `least` ≤ slope·x + offset ≤ `most`.
fn slab(slope: f64, offset: f64, least: f64, most: f64) -> (f64, f64) {
    if slope.abs() < 1e-9 {
        let inside = (least..=most).contains(&offset);
        return if inside { (f64::NEG_INFINITY, f64::INFINITY) } else { (1.0, -1.0) };
    }
    let (a, b) = ((least - offset) / slope, (most - offset) / slope);
    (a.min(b), a.max(b))
}

/// log₁₀ of the probability that at least `k` of `n` independent events of probability `p` happen.
fn log10_binomial_tail(n: usize, k: usize, p: f64) -> f64 {
    if k == 0 {
        return 0.0;
    }
    let (total, odds) = (n as f64, p / (1.0 - p));
    let first = log_factorial(n) - log_factorial(k) - log_factorial(n - k)
        + k as f64 * libm::log(p)
        + (n - k) as f64 * libm::log(1.0 - p);
    // Relative to the first term, which may be too small for a number.
    let (mut term, mut sum) = (1.0, 1.0);
    for i in k + 1..=n {
        let ratio = (total - i as f64 + 1.0) / i as f64 * odds;
        term *= ratio;
        sum += term;
        // The ratios fall: a geometric series bounds the rest.
        if ratio < 1.0 && term * ratio / (1.0 - ratio) < 1e-3 * sum {
            break;
        }
        if sum > 1e200 {
            return 0.0;
        }
    }
    ((first + libm::log(sum)) / LN_10).min(0.0)
}

/// ln n!, by Stirling's series.
fn log_factorial(n: usize) -> f64 {
    if n < 2 {
        return 0.0;
    }
    let n = n as f64;
    n * libm::log(n) - n + 0.5 * libm::log(2.0 * PI * n) + 1.0 / (12.0 * n) - 1.0 / (360.0 * n * n * n)
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// The tail, term by term from Pascal's triangle.
    fn tail(n: usize, k: usize, p: f64) -> f64 {
        let mut row = vec![0.0; n + 1];
        row[0] = 1.0;
        for _ in 0..n {
            for i in (1..=n).rev() {
                row[i] = row[i] * (1.0 - p) + row[i - 1] * p;
            }
            row[0] *= 1.0 - p;
        }
        row[k..].iter().sum()
    }

    #[test]
    fn binomial_tail_is_the_sum_of_its_terms() {
        for n in [1, 2, 7, 40, 150] {
            for k in 0..=n {
                for p in [0.125, 0.0625, 0.004] {
                    let (got, expected) = (log10_binomial_tail(n, k, p), libm::log10(tail(n, k, p)));
                    if expected < -290.0 {
                        continue; // the direct sum underflows
                    }
                    assert!((got - expected).abs() < 2e-3, "{n} {k} {p}: {got}, {expected}");
                }
            }
        }
    }

    #[test]
    fn binomial_tail_bears_large_numbers() {
        assert!(log10_binomial_tail(100_000, 90_000, 0.125) < -60_000.0);
        assert_eq!(log10_binomial_tail(100_000, 10, 0.125), 0.0);
    }
}
