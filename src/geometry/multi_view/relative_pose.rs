//! Rotation and direction of translation of a pair of photos, for a known focal length.

use nalgebra::{Matrix3, Vector3};

use super::self_calibration::{calibrated, essential};
use super::{Lens, PairLink};
use crate::geometry::ModelKind;
use crate::geometry::calibrated::nearest_rotation;
use crate::geometry::eigen::eigenpairs;
use crate::geometry::epipolar::{Motion, Rays, decompose, in_front, rotation_between};
use crate::statistics::median;

/// A calibrated homography whose images are this close to those of a rotation, in pixels, at the median, is one.
const TURNED: f64 = 3.0;

/// The motion from the first photo of a pair to the second.
#[derive(Debug, Clone)]
pub(super) struct RelativePose {
    pub photos: [usize; 2],
    pub rotation: Matrix3<f64>,
    /// Of length 1; `None` if the camera only turned, or nearly so.
    pub direction: Option<Vector3<f64>>,
    /// How much it says: the number of matches.
    pub weight: f64,
}

/// The pose of a pair; `focals` are those of its photos, in diagonals. `None` if the pair has none.
pub(super) fn relative_pose(link: &PairLink, lenses: &[Lens], focals: [f64; 2]) -> Option<RelativePose> {
    let rays = rays(link, lenses, focals);
    let model = link.centred(lenses);
    let pose = |rotation, direction| RelativePose {
        photos: link.photos,
        rotation,
        direction,
        weight: link.matches.len() as f64,
    };
    if link.kind == ModelKind::TwoView {
        let matrix = essential(&model, focals);
        let (rotation, direction) = in_front(&rays, &decompose(&matrix)?)?;
        return Some(pose(rotation, Some(direction)));
    }
    let calibrated = calibrated(&model.h, focals);
    let rotation = nearest_rotation(calibrated)?;
    let pixels = focals[1] * crate::rect::diagonal(lenses[link.photos[1]].size);
    let distance = |[from, to]: &Rays| {
        let p = rotation * from;
        pixels * ((p[0] / p[2] - to[0] / to[2]).powi(2) + (p[1] / p[2] - to[1] / to[2]).powi(2)).sqrt()
    };
    if median(rays.iter().map(distance).collect())? <= TURNED {
        return Some(pose(rotation, None));
    }
    let candidates = decompose_homography(&calibrated)?;
    let (rotation, direction) = in_front(&rays, &candidates)?;
    Some(pose(rotation, Some(direction)))
}

/// The rotation that comes closest to the matches of a pair: its motion, if the cameras only turned. It hardly depends on how the lens
/// distorts, as the perspective in a homography or an essential matrix does.
pub(super) fn turn(link: &PairLink, lenses: &[Lens], focals: [f64; 2]) -> Option<RelativePose> {
    let rays = rays(link, lenses, focals);
    let rotation = rotation_between(&rays, &vec![1.0; rays.len()])?;
    Some(RelativePose { photos: link.photos, rotation, direction: None, weight: link.matches.len() as f64 })
}

/// The rays of a pair's matches in the axes of either camera.
fn rays(link: &PairLink, lenses: &[Lens], focals: [f64; 2]) -> Vec<Rays> {
    let ray = |[x, y]: [f64; 2], focal: f64| Vector3::new(x / focal, y / focal, 1.0);
    link.centred_matches(lenses).iter().map(|ends| [0, 1].map(|k| ray(ends[k], focals[k]))).collect()
}

/// The motions of a calibrated homography of a plane (Ma, Soatto, Košecká & Sastry, *An Invitation to 3-D Vision*, 5.3.3); of
/// those with either sign, the one whose plane faces the camera. The one whose plane faces it most directly comes first.
fn decompose_homography(h: &Matrix3<f64>) -> Option<Vec<Motion>> {
    let [_, (middle, _), _] = eigenpairs(&(h.transpose() * *h))?;
    let h = h / middle.max(0.0).sqrt();
    let [first, second, third] = eigenpairs(&(h.transpose() * h))?;
    let difference = (first.0 - third.0).max(1e-12).sqrt();
    let (a, b) = ((1.0 - third.0).max(0.0).sqrt() / difference, (first.0 - 1.0).max(0.0).sqrt() / difference);
    let mut found = Vec::new();
    for u in [first.1 * a + third.1 * b, first.1 * a - third.1 * b] {
        let from = Matrix3::from_columns(&[second.1, u, second.1.cross(&u)]);
        let (second, turned) = (h * second.1, h * u);
        let to = Matrix3::from_columns(&[second, turned, second.cross(&turned)]);
        let rotation = nearest_rotation(to * from.transpose())?;
        let normal = from.column(2).into_owned();
        let translation = (h - rotation) * normal;
        let sign = if normal[2] < 0.0 { -1.0 } else { 1.0 };
        let length = translation.norm();
        if length > 0.0 {
            found.push((normal[2].abs(), rotation, translation * (sign / length)));
        }
    }
    if let [one, other] = &mut found[..]
        && one.0 < other.0
    {
        std::mem::swap(one, other);
    }
    Some(found.into_iter().map(|(_, rotation, translation)| (rotation, translation)).collect())
}
