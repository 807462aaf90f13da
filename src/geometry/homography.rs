//! The homography that fits given matches best, without a doubt about any of them.

use super::points::{Normalisation, Points};
use super::{Match, Model, linear, refine};

/// Gains smaller than this share end the refinement.
const TOLERANCE: f64 = 1e-8;

/// The homography with the least sum of squared transfer errors over all matches; `None` when they do not determine one.
pub fn homography(matches: &[Match]) -> Option<Model> {
    let mut points = Points::default();
    matches.iter().for_each(|m| points.push(m.target, 0.0, m.reference));
    let normalisation = Normalisation::of(&points);
    let points = normalisation.apply(&points);
    let all: Vec<usize> = (0..points.len()).collect();
    let start = linear::fit(&points, &all, 3, 1e-9)?;
    // In front of the camera.
    let start = if start[2][2] < 0.0 { start.map(|row| row.map(|v| -v)) } else { start };
    let mut model = normalisation.model(&refine::refine(&points, &start, 3, TOLERANCE));
    model.e.fill(0.0);
    model.is_finite().then_some(model)
}
