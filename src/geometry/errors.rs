//! How far matches are from where a model has them.

use wide::{CmpLt, f64x2};

use super::points::{Point, Points, Projection, transform};

/// What matches can be measured against.
pub(super) trait Errors {
    /// The squared error of a match.
    fn error(&self, point: &Point) -> f64;

    /// The squared errors of as many matches as both have: one call for many of them.
    fn fill(&self, points: &[Point], errors: &mut [f64]) {
        for (error, point) in errors.iter_mut().zip(points) {
            *error = self.error(point);
        }
    }
}

/// Transfer errors in front of the camera, infinite behind it.
impl Errors for Projection {
    #[inline(always)]
    fn error(&self, p: &Point) -> f64 {
        let [a, b, w] = transform(self, p.x, p.y, p.d);
        let reciprocal = 1.0 / w;
        let (du, dv) = (a * reciprocal - p.u, b * reciprocal - p.v);
        if w > 0.0 { du * du + dv * dv } else { f64::INFINITY }
    }
}

/// The squared errors of all matches.
#[inline(never)]
pub(super) fn errors(points: &Points, model: &dyn Errors) -> Vec<f64> {
    let mut errors = vec![0.0; points.len()];
    model.fill(points, &mut errors);
    errors
}

/// The squared errors of those within the threshold.
#[inline(never)]
pub(super) fn inlying(points: &Points, model: &dyn Errors, threshold: f64) -> Vec<f64> {
    let mut errors = errors(points, model);
    errors.retain(|e| *e < threshold * threshold);
    errors
}

/// Which matches are within the threshold.
#[inline(never)]
pub(super) fn inliers_of(points: &Points, model: &dyn Errors, threshold: f64) -> Vec<bool> {
    errors(points, model).into_iter().map(|e| e < threshold * threshold).collect()
}

/// How many flags are set.
#[inline(never)]
pub(super) fn count(flags: &[bool]) -> usize {
    flags.iter().filter(|f| **f).count()
}

/// The thresholds at which a model is judged, in normalised coordinates, widest first.
///
/// The cost of a match is Σ_k min(r²/t_k², 1): MSAC (Torr & Zisserman 2000) summed over the scales, so that neither a
/// chance consensus at the narrowest nor a sloppy one at the widest wins. With all three equal it is MSAC.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales(pub [f64; 3]);

impl Scales {
    /// Between a wide and a narrow threshold.
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
    #[inline(never)]
    pub fn cost(&self, points: &Points, model: &dyn Errors, limit: f64) -> f64 {
        const BLOCK: usize = 64;
        let (inverse, one) = (self.0.map(|t| 1.0 / (t * t)), f64x2::splat(1.0));
        let mut cost = 0.0;
        for block in points.chunks(BLOCK) {
            if cost >= limit {
                break;
            }
            // What is left of the last block costs nothing.
            let mut errors = [0.0; BLOCK];
            model.fill(block, &mut errors);
            // Lanes of their own, so that the additions need not wait for each other.
            let mut sums = [f64x2::ZERO; 2];
            for chunk in errors.as_chunks::<4>().0 {
                let [a, b, c, d] = *chunk;
                for (sum, squares) in sums.iter_mut().zip([[a, b], [c, d]]) {
                    for scale in inverse {
                        let share = f64x2::new(squares) * f64x2::splat(scale);
                        *sum += share.cmp_lt(one).blend(share, one);
                    }
                }
            }
            let [[a, b], [c, d]] = sums.map(f64x2::to_array);
            cost += a + b + c + d;
        }
        cost
    }
}
