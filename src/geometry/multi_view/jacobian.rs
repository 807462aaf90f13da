//! The unknowns of bundle adjustment, and the derivatives of reprojection errors by them.

use nalgebra::Vector3;

use super::bundle::FreeParameters;
use super::scene::{Camera, Landmark, Scene};
use super::tracks::Observation;
use crate::geometry::epipolar::Motion;

/// Which unknown is where: first the focal length, then the distortion, then each photo's pose and its share of the focal length.
pub(super) struct Unknowns {
    pub free: FreeParameters,
    /// The first one of each photo's pose; `None` where it stays.
    pub offsets: Vec<Option<usize>>,
    /// Each photo's share of the focal length; `None` where it stays.
    pub shares: Vec<Option<usize>>,
    pub per_photo: usize,
    pub count: usize,
}

impl Unknowns {
    pub fn of(scene: &Scene, root: usize, free: FreeParameters) -> Self {
        let per_photo = if free.positions { 6 } else { 3 };
        let mut count = if free.distortion { 2 } else { 1 };
        let (mut offsets, mut shares) = (Vec::new(), Vec::new());
        let mut next = |is_unknown: bool, size: usize| {
            count += if is_unknown { size } else { 0 };
            is_unknown.then(|| count - size)
        };
        for (photo, camera) in scene.cameras.iter().enumerate() {
            offsets.push(next(camera.is_some() && photo != root, per_photo));
            shares.push(next(camera.is_some() && scene.estimates[photo].is_some(), 1));
        }
        Self { free, offsets, shares, per_photo, count }
    }
}

/// R and t from each camera to each other.
pub(super) struct Motions {
    cameras: usize,
    motions: Vec<Option<Motion>>,
}

impl Motions {
    pub fn of(scene: &Scene) -> Self {
        let cameras = &scene.cameras;
        let from = |from: &Option<Camera>| cameras.iter().map(|to| Some((*from)?.motion_to(to.as_ref()?))).collect();
        Self { cameras: cameras.len(), motions: cameras.iter().flat_map(|camera| -> Vec<_> { from(camera) }).collect() }
    }

    pub fn between(&self, [from, to]: [usize; 2]) -> Option<&Motion> {
        self.motions[from * self.cameras + to].as_ref()
    }
}

/// The derivatives of one observation's error.
pub(super) struct Row {
    pub error: [f64; 2],
    /// Unknown, and the slopes of both coordinates, in the order of the unknowns, as the anchor is the first photo of a track.
    pub slopes: [(usize, [f64; 2]); 16],
    pub count: usize,
    /// How many of them are of unknowns that belong to all observations of the landmark.
    pub shared: usize,
    pub depth: [f64; 2],
}

impl Row {
    pub fn new(error: [f64; 2], depth: [f64; 2]) -> Self {
        Self { error, slopes: [(0, [0.0; 2]); 16], count: 0, shared: 0, depth }
    }

    pub fn of(
        scene: &Scene,
        unknowns: &Unknowns,
        motions: &Motions,
        landmark: &Landmark,
        o: &Observation,
    ) -> Option<Self> {
        let photos = [landmark.anchor.photo, o.photo];
        let (rotation, t) = motions.between(photos)?;
        let [from, to] = photos.map(|photo| scene.cameras[photo].as_ref());
        let w = landmark.depth;
        let ray = scene.ray(&landmark.anchor);
        let seen = scene.error(rotation * ray + t * w, o)?;
        let p = seen.point;
        let scale = scene.diagonals[o.photo] * scene.focal(o.photo) / p[2];
        // Of both coordinates: the slopes by the point in the axes of this camera, and of the anchor's.
        let slopes = [Vector3::new(scale, 0.0, -scale * p[0] / p[2]), Vector3::new(0.0, scale, -scale * p[1] / p[2])];
        let of_anchor = slopes.map(|slope| rotation.tr_mul(&slope));
        let depth = slopes.map(|slope| slope.dot(t));
        let mut row = Self::new(seen.error, depth);
        // A longer lens enlarges this photo, and straightens the rays of the other.
        let bent = of_anchor.map(|slope| -(slope[0] * ray[0] + slope[1] * ray[1]));
        let enlarged = [scale * p[0], scale * p[1]];
        row.put(0, [0, 1].map(|k| bent[k] + enlarged[k]));
        if unknowns.free.distortion {
            let [of_ray, of_place] = [&landmark.anchor, o].map(|o| scene.distortion.slope(o.place));
            let (f, unit) = (scene.focal(photos[0]), scene.diagonals[o.photo]);
            let moved = of_anchor.map(|slope| (slope[0] * of_ray[0] + slope[1] * of_ray[1]) / f);
            row.put(1, [moved[0] - unit * of_place[0], moved[1] - unit * of_place[1]]);
        }
        let [anchor, own] = photos.map(|photo| unknowns.shares[photo]);
        // ω × v = −[v]× ω; R_to Rᵀ_from exp(−ω) c moves by R [c]× ω.
        let c = ray - from?.translation * w;
        row.put_pose(unknowns, photos[0], of_anchor.map(|slope| slope.cross(&c)), of_anchor.map(|slope| slope * -w));
        anchor.into_iter().for_each(|at| row.put(at, bent));
        row.shared = row.count;
        let v = p - to?.translation * w;
        row.put_pose(unknowns, photos[1], slopes.map(|slope| v.cross(&slope)), slopes.map(|slope| slope * w));
        own.into_iter().for_each(|at| row.put(at, enlarged));
        Some(row)
    }

    pub fn put_pose(&mut self, unknowns: &Unknowns, photo: usize, turn: [Vector3<f64>; 2], shift: [Vector3<f64>; 2]) {
        let Some(at) = unknowns.offsets[photo] else { return };
        (0..3).for_each(|k| self.put(at + k, turn.map(|slopes| slopes[k])));
        if unknowns.free.positions {
            (0..3).for_each(|k| self.put(at + 3 + k, shift.map(|slopes| slopes[k])));
        }
    }

    fn put(&mut self, at: usize, slopes: [f64; 2]) {
        self.slopes[self.count] = (at, slopes);
        self.count += 1;
    }
}
