//! The straight line y = a·x + b through weighted points.

/// Sums over points, from which the line follows that has the least squares.
#[derive(Default)]
pub(crate) struct LineFit {
    weight: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl LineFit {
    #[inline(always)]
    pub fn add(&mut self, x: f64, y: f64, weight: f64) {
        self.weight += weight;
        self.x += weight * x;
        self.y += weight * y;
        self.xx += weight * x * x;
        self.xy += weight * x * y;
    }

    /// a and b; `None` where all points have one x.
    pub fn line(&self) -> Option<[f64; 2]> {
        let Self { weight, x, y, xx, xy } = *self;
        let determinant = weight * xx - x * x;
        (determinant > 1e-12 * weight * xx).then(|| {
            let slope = (weight * xy - x * y) / determinant;
            [slope, (y - slope * x) / weight]
        })
    }

    /// b where a is to be 0: the mean.
    pub fn constant(&self) -> f64 {
        self.y / self.weight
    }

    /// a where b is to be 0.
    pub fn proportion(&self) -> f64 {
        self.xy / self.xx
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn goes_through_what_is_on_a_line_and_by_weight_between_what_is_not() {
        let mut fit = LineFit::default();
        for (x, weight) in [(-3.0, 0.2), (1.0, 4.0), (7.0, 1.0)] {
            fit.add(x, 0.5 * x - 2.0, weight);
        }
        let off = |[a, b]: [f64; 2]| (a - 0.5).abs().max((b + 2.0).abs());
        assert!(fit.line().is_some_and(|line| off(line) < 1e-12));
        let mut upright = LineFit::default();
        upright.add(2.0, 1.0, 3.0);
        upright.add(2.0, 5.0, 1.0);
        assert_eq!((upright.line(), upright.constant(), upright.proportion()), (None, 2.0, 1.0));
    }
}
