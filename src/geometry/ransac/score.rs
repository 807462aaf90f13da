//! How far matches are from where a model has them, and what that costs.

use wide::{CmpLt, f64x2};

use crate::geometry::correspondences::{Correspondence, Correspondences};

/// A model that matches can be measured against.
pub(in crate::geometry) trait Residual {
    /// The squared error of a match in the units of the points, which a search has normalised; infinite where the model has no
    /// image of it.
    fn squared_error(&self, point: &Correspondence) -> f64;
}

/// The squared errors of all matches.
pub(in crate::geometry) fn squared_errors(points: &[Correspondence], model: &impl Residual) -> Vec<f64> {
    points.iter().map(|point| model.squared_error(point)).collect()
}

/// The squared errors of those within the threshold.
pub(in crate::geometry) fn inlier_errors(points: &Correspondences, model: &impl Residual, threshold: f64) -> Vec<f64> {
    let mut errors = squared_errors(points, model);
    errors.retain(|e| *e < threshold * threshold);
    errors
}

/// Which matches are within the threshold.
pub(in crate::geometry) fn inliers_of(points: &Correspondences, model: &impl Residual, threshold: f64) -> Vec<bool> {
    points.iter().map(|point| model.squared_error(point) < threshold * threshold).collect()
}

/// How many flags are set.
pub(in crate::geometry) fn count(flags: impl IntoIterator<Item = bool>) -> usize {
    flags.into_iter().filter(|flag| *flag).count()
}

/// The thresholds at which a model is scored, in normalised coordinates, widest first.
///
/// The cost of a match is Σ_k min(r²/t_k², 1): MSAC (Torr & Zisserman 2000) summed over the scales, so that neither a
/// chance consensus at the narrowest nor an inaccurate one at the widest wins. With all three equal it is MSAC.
#[derive(Debug, Clone, Copy)]
pub(in crate::geometry) struct Scales(pub [f64; 3]);

impl Scales {
    /// A wide threshold, a narrow one, and their geometric mean.
    pub fn between(wide: f64, narrow: f64) -> Self {
        let wide = wide.max(narrow);
        Self([wide, (wide * narrow).sqrt(), narrow])
    }

    pub fn widest(&self) -> f64 {
        self.0[0]
    }

    pub fn narrowest(&self) -> f64 {
        self.0[2]
    }

    /// Cost of a model. Stops once it reaches `limit`.
    pub fn cost(&self, points: &Correspondences, model: &impl Residual, limit: f64) -> f64 {
        const BLOCK: usize = 64;
        let (inverse, one) = (self.0.map(|t| 1.0 / (t * t)), f64x2::splat(1.0));
        let mut cost = 0.0;
        for block in points.chunks(BLOCK) {
            if cost >= limit {
                break;
            }
            // The unused rest of the last block costs nothing.
            let mut errors = [0.0; BLOCK];
            for (error, point) in errors.iter_mut().zip(block) {
                *error = model.squared_error(point);
            }
            // Two independent sums, so that the additions need not wait for each other.
            let mut sums = [f64x2::ZERO; 2];
            for chunk in errors.as_chunks::<4>().0 {
                let [a, b, c, d] = *chunk;
                for (sum, squares) in sums.iter_mut().zip([[a, b], [c, d]]) {
                    for scale in inverse {
                        let ratio = f64x2::new(squares) * f64x2::splat(scale);
                        *sum += ratio.cmp_lt(one).blend(ratio, one);
                    }
                }
            }
            let [[a, b], [c, d]] = sums.map(f64x2::to_array);
            cost += a + b + c + d;
        }
        cost
    }
}
