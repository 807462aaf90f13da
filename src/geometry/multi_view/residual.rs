//! Reprojection errors and their derivatives.

use nalgebra::Vector3;

use super::jacobian::{Slopes, slopes};
use super::scene::{Camera, Scene};
use super::tracks::Observation;
use crate::geometry::epipolar::Motion;

/// The error of one observation of a landmark.
pub(super) struct Residual {
    pub error: [f64; 2],
    /// Of both coordinates.
    pub slopes: [Slopes; 2],
    /// Slopes by the landmark's inverse depth.
    pub depth: [f64; 2],
}

impl Residual {
    /// Of a landmark at this inverse depth; `motion` leads from the camera of its `anchor` to the one that sees it. `None` behind that.
    pub fn of(scene: &Scene, motion: &Motion, [anchor, o]: [&Observation; 2], depth: f64) -> Option<Self> {
        let (rotation, t) = motion;
        let ray = scene.ray(anchor);
        let turned = rotation * ray;
        let seen = scene.error(turned + t * depth, o)?;
        let p = seen.point;
        let to = scene.cameras[o.photo].as_ref()?;
        let unit = scene.diagonals[o.photo];
        let scale = unit * scene.focal(o.photo) / p[2];
        let by_point = [Vector3::new(scale, 0.0, -scale * p[0] / p[2]), Vector3::new(0.0, scale, -scale * p[1] / p[2])];
        // A longer lens straightens the rays of its photo, and enlarges what the other one shows.
        let bent = rotation.column(2) - turned;
        let [of_ray, of_place] = [anchor, o].map(|o| scene.distortion.slope(o.place));
        let moved = (rotation.column(0) * of_ray[0] + rotation.column(1) * of_ray[1]) / scene.focal(anchor.photo);
        // ω × v = −[v]× ω.
        let v = p - to.translation * depth;
        let slopes = [0, 1].map(|k| {
            let slope = &by_point[k];
            let lens = [slope.dot(&bent), scale * p[k], slope.dot(&moved) - unit * of_place[k]];
            slopes(v.cross(slope), slope * depth, lens)
        });
        Some(Self { error: seen.error, slopes, depth: by_point.map(|slope| slope.dot(t)) })
    }

    /// Those of the vector from the first to the second camera in the axes of the second, `t`, as if each of its coordinates should be 0.
    pub fn of_baseline((rotation, t): &Motion, from: &Camera) -> [(f64, Slopes); 3] {
        let v = -(rotation * from.translation);
        [0, 1, 2].map(|k| {
            let axis = Vector3::ith(k, 1.0);
            (t[k], slopes(v.cross(&axis), axis, [0.0; 3]))
        })
    }
}
