//! Selection of inliers and least squares on them, in turns.

use super::Estimator;
use super::score::inliers_of;
use crate::geometry::correspondences::Correspondences;

/// Most iterations of [`converge`]; few fits need more than five.
const ITERATIONS: usize = 20;

/// Selects inliers and refits to them, `iterations` times at each threshold, usually a decreasing series. Ends early where
/// too few inliers are left.
pub(in crate::geometry) fn anneal<E: Estimator>(
    estimator: &E,
    points: &Correspondences,
    start: &E::Model,
    thresholds: impl IntoIterator<Item = f64>,
    iterations: usize,
    tolerance: f64,
) -> E::Model {
    let mut model = *start;
    for threshold in thresholds {
        for _ in 0..iterations {
            let inliers = inliers_of(points, &model, threshold);
            let Some(refined) = estimator.refine(points, &inliers, &model, tolerance) else { return model };
            model = refined;
        }
    }
    model
}

/// Selects inliers and refits to them until they stay the same; the model and its inliers. `None` if too few are left.
pub(in crate::geometry) fn converge<E: Estimator>(
    estimator: &E,
    points: &Correspondences,
    start: &E::Model,
    threshold: f64,
    tolerance: f64,
) -> Option<(E::Model, Vec<bool>)> {
    let mut model = *start;
    let mut inliers = inliers_of(points, &model, threshold);
    for _ in 0..ITERATIONS {
        model = estimator.refine(points, &inliers, &model, tolerance)?;
        let next = inliers_of(points, &model, threshold);
        if next == inliers {
            break;
        }
        inliers = next;
    }
    Some((model, inliers))
}
