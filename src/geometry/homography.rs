//! The homography that fits given matches best, all of which are taken as inliers.

use super::correspondences::Correspondences;
use super::normalisation::Normalisation;
use super::projection::ProjectionEstimator;
use super::{Match, Model};

/// Where least squares stop: when a step reduces the cost by less than this fraction.
const TOLERANCE: f64 = 1e-8;

/// The homography with the least sum of squared transfer errors over all matches; `None` if they do not determine one.
pub fn homography(matches: &[Match]) -> Option<Model> {
    let mut points = Correspondences::default();
    matches.iter().for_each(|m| points.push(m.target, 0.0, m.reference));
    let normalisation = Normalisation::hartley(&points);
    let points = normalisation.apply(&points);
    let projection = ProjectionEstimator::Homography.fit(&points, &vec![true; points.len()], None, TOLERANCE)?;
    let mut model = normalisation.model(&projection);
    model.e.fill(0.0);
    model.is_finite().then_some(model)
}
