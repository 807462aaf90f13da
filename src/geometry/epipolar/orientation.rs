//! Which of two things is nearer: plane and parallax leave the sign of the relative inverse depth open.

use nalgebra::{Matrix3, Vector3};

use super::fundamental::cofactors;
use crate::geometry::model::Model;
use crate::rect::diagonal;

/// The focal length taken for every photo's, in diagonals: hardly any lens is so different that things change sides.
const FOCAL: f64 = 0.7;

/// Whether the relative inverse depth of `model` is larger for what is farther: e is −t rather than t, as most matches (target, reference)
/// are in front of both cameras with that translation t. `sizes` are those of the photos.
pub(super) fn is_inverted(
    model: &Model,
    matches: impl Iterator<Item = [[f64; 2]; 2]>,
    sizes: [(usize, usize); 2],
) -> bool {
    let [source, destination] = sizes.map(|(w, h)| {
        let (f, [x, y]) = (FOCAL * diagonal((w, h)), [w, h].map(|side| 0.5 * (side as f64 - 1.0)));
        // K and its inverse.
        (Matrix3::new(f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0), Matrix3::new(1.0, 0.0, -x, 0.0, 1.0, -y, 0.0, 0.0, f) / f)
    });
    let (h, e) = (destination.1 * model.h * source.0, destination.1 * model.e);
    let essential = e.cross_matrix() * h;
    // [e]× H is [e]× R, whose cofactors are eeᵀR; and [e]× squared is eeᵀ − e·e.
    let rotation = cofactors(&essential) - e.cross_matrix() * essential;
    let votes = matches.map(|ends| {
        let [x, u] = [(source.1, ends[0]), (destination.1, ends[1])].map(|(k, [x, y])| k * Vector3::new(x, y, 1.0));
        // z'u = zRx + t: cross products with u and with Rx leave either depth.
        let far = rotation * x;
        let across = u.cross(&far);
        match [e.cross(&u), e.cross(&far)].map(|side| across.dot(&side) > 0.0) {
            [true, true] => 1,
            [false, false] => -1,
            _ => 0,
        }
    });
    votes.sum::<i32>() < 0
}
