//! Self-calibration of two photos: the cameras of one usual lens that explain their matches best.

use nalgebra::{Matrix3, Vector3};

use super::essential::{Motion, Rays, decompose, in_front, refine_cameras};
use crate::geometry::calibrated::PAIR_FOCAL_DEVIATION;
use crate::geometry::model::Model;

/// A usual focal length in diagonals (33 mm on a 35 mm camera), and the standard deviation of its logarithm, with which it gives way only where
/// many matches ask for it: with a weak prior it runs away in scenes that are nearly flat.
const FOCAL: [f64; 2] = [0.765, 0.03];
/// Distance in pixels from the epipolar line from which on a match counts less.
const NOISE: f64 = 1.0;
/// A photo whose frame is larger than it by less than this ratio was not cropped: sizes are whole numbers.
const COMPLETE: f64 = 1.01;
/// Fewer matches determine no essential matrix.
const FEWEST: usize = 8;

/// Two cameras.
pub(super) struct TwoCameras {
    /// Of all matches.
    pub rays: Vec<Rays>,
    pub motion: Motion,
    /// K⁻¹ of the second one.
    pub back: Matrix3<f64>,
}

/// The cameras that explain the `matches` of photos of these `sizes`, which `model` explains without cameras; `focal` is the first
/// one's focal length in pixels, if that is known. `None` if the matches determine none.
pub(super) fn two_cameras(
    model: &Model,
    matches: &[[[f64; 2]; 2]],
    sizes: [(usize, usize); 2],
    focal: Option<f64>,
) -> Option<TwoCameras> {
    if matches.len() < FEWEST {
        return None;
    }
    let deviation = focal.map_or(FOCAL[1], |_| PAIR_FOCAL_DEVIATION);
    let fit = |[target, reference]: [Intrinsics; 2]| {
        let mut rays: Vec<Rays> = matches.iter().map(|[x, u]| [target.ray(*x), reference.ray(*u)]).collect();
        let back = reference.matrix().try_inverse()?;
        let essential = (back * model.e).cross_matrix() * (back * model.h * target.matrix());
        let start = in_front(&rays, &decompose(&essential)?)?;
        let (found, cost) = refine_cameras(&rays, start, NOISE / reference.focal, deviation);
        rays.iter_mut().for_each(|ray| *ray = found.rays(ray));
        // Of the four motions of an essential matrix. Before the refinement it is not always to be told which is the right one.
        let motion = in_front(&rays, &decompose(&found.essential())?)?;
        Some((TwoCameras { rays, motion, back }, cost))
    };
    let fits = intrinsics(sizes, focal).into_iter().filter_map(fit).filter(|(_, cost)| cost.is_finite());
    fits.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(found, _)| found)
}

/// A pinhole camera with square pixels.
pub(super) struct Intrinsics {
    /// In pixels.
    pub focal: f64,
    /// The principal point.
    centre: [f64; 2],
}

impl Intrinsics {
    pub fn ray(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        Vector3::new((x - self.centre[0]) / self.focal, (y - self.centre[1]) / self.focal, 1.0)
    }

    pub fn matrix(&self) -> Matrix3<f64> {
        let (f, [x, y]) = (self.focal, self.centre);
        Matrix3::new(f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0)
    }
}

/// The intrinsics of one lens that may have taken photos of these sizes. A photo of other proportions than the other one was cropped: on both sides
/// alike, or on one of them.
pub(super) fn intrinsics(sizes: [(usize, usize); 2], focal: Option<f64>) -> Vec<[Intrinsics; 2]> {
    let sides = sizes.map(|(w, h)| [w as f64, h as f64]);
    let frames = frames(sides);
    let diagonal = |[w, h]: [f64; 2]| (w * w + h * h).sqrt();
    let share = focal.map_or(FOCAL[0], |focal| focal / diagonal(frames[0]));
    let missing = [0, 1].map(|k| [0, 1].map(|axis| frames[k][axis] - sides[k][axis]));
    let cropped = missing.iter().flatten().any(|missing| *missing >= 1.0);
    let shifts: &[f64] = if cropped { &[0.0, -0.5, 0.5] } else { &[0.0] };
    let camera = |k: usize, shift: f64| Intrinsics {
        focal: share * diagonal(frames[k]),
        centre: [0, 1].map(|axis| 0.5 * (sides[k][axis] - 1.0) + shift * missing[k][axis]),
    };
    shifts.iter().map(|&shift| [0, 1].map(|k| camera(k, shift))).collect()
}

/// Width and height of the frames that photos of these widths and heights were cropped from, if both have the same proportions, upright or on
/// their side: those of one of the photos, such that nothing is missing, or otherwise such that the frames are as alike as possible.
fn frames(sides: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    // The least frame around a photo, w : h being v : u.
    let around = |[w, h]: [f64; 2], [v, u]: [f64; 2]| [w.max(h * v / u), h.max(w * u / v)];
    let turned = |[w, h]: [f64; 2]| [h, w];
    let area = |[w, h]: [f64; 2]| w * h;
    let [first, second] = sides;
    let choices = [
        [first, around(second, first)],
        [first, around(second, turned(first))],
        [around(first, second), second],
        [around(first, turned(second)), second],
    ];
    let ratio = |a: f64, b: f64| (a / b).max(b / a);
    let cost = |[a, b]: &[[f64; 2]; 2]| {
        let missing = ratio(area(*a), area(first)) * ratio(area(*b), area(second));
        if missing < COMPLETE { 0.0 } else { ratio(area(*a), area(*b)) }
    };
    choices.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(sides)
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn frames_of_cropped_photos() {
        let whole = [1200.0, 800.0];
        assert_eq!(frames([whole, whole]), [whole, whole]);
        // Reduced, on its side, cut off at one side, and both at once.
        assert_eq!(frames([whole, [600.0, 400.0]]), [whole, [600.0, 400.0]]);
        assert_eq!(frames([[800.0, 1200.0], whole]), [[800.0, 1200.0], whole]);
        assert_eq!(frames([whole, [900.0, 800.0]]), [whole, whole]);
        assert_eq!(frames([[1200.0, 500.0], whole]), [whole, whole]);
        assert_eq!(frames([[1100.0, 600.0], [1600.0, 1200.0]])[1], [1600.0, 1200.0]);
    }
}
