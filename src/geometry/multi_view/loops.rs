//! Which pairs contradict the others by their rotations, and the focal length that closes loops of photos.
//!
//! What pairs say of the focal length one by one rests on perspective, which a lens' distortion alters: of a full turn it may leave 50° open.
//! The turns that fit their matches best add up to 360° with the right focal length only (Szeliski & Shum, *Creating Full View Panoramic
//! Image Mosaics*, 1997).

use nalgebra::Matrix3;

use super::relative_pose::{RelativePose, turn};
use super::rotations::{are_wide, average, contradiction};
use super::self_calibration::Focal;
use super::{Lens, PairLink};

/// A pair whose rotation contradicts those of the others by more than this is a wrong one, in radians.
const CONTRADICTION: f64 = 0.12;
/// The standard deviation of ln f for a focal length that closes loops.
const CLOSING_FOCAL: f64 = 0.02;
/// Focal lengths that are tried: up to so many steps of this ratio from that of the pairs, each of which turns a full turn by half a
/// contradiction.
const STEPS: i32 = 35;
const RATIO: f64 = 1.01;

/// The rotations of all photos by those of their pairs.
pub(super) struct Rotations {
    /// The poses of the pairs that agree.
    pub poses: Vec<RelativePose>,
    /// The pairs that do not, by their index.
    pub contradicting: Vec<usize>,
    /// Of each photo.
    pub photos: Vec<Option<Matrix3<f64>>>,
    /// The sum of all angles by which pairs that agree do not quite, in radians.
    disagreement: f64,
}

impl Rotations {
    /// By the poses of the pairs, as far as they have one.
    pub fn of(poses: Vec<Option<RelativePose>>, photos: usize, root: usize) -> Self {
        let known: Vec<RelativePose> = poses.iter().flatten().cloned().collect();
        let rotations = average(&known, photos, root);
        let (mut contradicting, mut agreeing, mut disagreement) = (Vec::new(), Vec::new(), 0.0);
        for (i, pose) in poses.into_iter().enumerate() {
            let Some(pose) = pose else { continue };
            let angle = contradiction(&pose, &rotations).unwrap_or(0.0);
            if angle > CONTRADICTION {
                contradicting.push(i);
            } else {
                disagreement += angle;
                agreeing.push(pose);
            }
        }
        let photos = average(&agreeing, photos, root);
        Self { poses: agreeing, contradicting, photos, disagreement }
    }
}

/// The rotations with the focal length with which fewest pairs contradict the others when cameras are taken to turn only; `None` unless
/// that is fewer than `contradict` otherwise.
pub(super) fn close_loops(
    lenses: &[Lens],
    links: &[PairLink],
    focal: &Focal,
    contradict: usize,
    root: usize,
) -> Option<(Focal, Rotations)> {
    if contradict == 0 {
        return None;
    }
    let mut best: Option<(Focal, Rotations)> = None;
    for step in -STEPS..=STEPS {
        let value = focal.value * libm::pow(RATIO, f64::from(step));
        let focal = Focal { value, prior: [libm::log(value), CLOSING_FOCAL], ..focal.clone() };
        let turned = |link: &PairLink| turn(link, lenses, focal.of(link.photos));
        let found = Rotations::of(links.iter().map(turned).collect(), lenses.len(), root);
        let rank = |rotations: &Rotations| (rotations.contradicting.len(), rotations.disagreement);
        let fewest = best.as_ref().is_none_or(|(_, best)| rank(&found) < rank(best));
        if found.contradicting.len() < contradict && fewest && are_wide(&found.photos) {
            best = Some((focal, found));
        }
    }
    best
}
