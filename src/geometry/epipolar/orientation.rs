//! Which of two things is nearer: plane and parallax leave the sign of the relative inverse depth open.

use super::cameras::two_cameras;
use crate::geometry::model::Model;

/// Most matches that are asked: they decide clearly.
const MATCHES: usize = 200;

/// Whether the relative inverse depth of `model` is larger for what is farther: e is −t rather than t, as most matches (target, reference)
/// are in front of both cameras with that translation t. `sizes` are those of the photos.
pub(super) fn is_inverted(model: &Model, matches: &[[[f64; 2]; 2]], sizes: [(usize, usize); 2]) -> bool {
    let step = matches.len().div_ceil(MATCHES).max(1);
    let some: Vec<_> = matches.iter().step_by(step).copied().collect();
    // The third coordinate of what H and e make of a match is positive.
    two_cameras(model, &some, sizes, None).is_some_and(|cameras| (cameras.back * model.e).dot(&cameras.motion.1) < 0.0)
}
