//! Cameras and points: the unknowns of bundle adjustment.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::Lens;
use super::self_calibration::Focal;
use super::tracks::{Observation, Track};
use crate::geometry::{Distortion, Model};
use crate::rect::diagonal;
use crate::statistics::{RAYLEIGH_MEDIAN, median};

/// Features are not localised better, nor kept if they are worse, in pixels.
const LEAST_NOISE: f64 = 0.1;
pub(super) const MOST_NOISE: f64 = 1.0;
/// An observation counts as explained up to this error, as a share of the diagonal: 2.5 pixels of 1300.
pub(super) const EXPLAINED: f64 = 0.0019;

/// A camera in the scene: X_cam = R X + t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// R.
    pub rotation: Matrix3<f64>,
    /// t, in a unit that all cameras share.
    pub translation: Vector3<f64>,
}

impl Camera {
    pub(super) fn turned(rotation: Matrix3<f64>) -> Self {
        Self { rotation, translation: Vector3::zeros() }
    }

    /// R and t of the motion from this camera's coordinates to those of another.
    pub(super) fn motion_to(&self, other: &Self) -> (Matrix3<f64>, Vector3<f64>) {
        let rotation = other.rotation * self.rotation.transpose();
        (rotation, other.translation - rotation * self.translation)
    }
}

/// A scene point: the ray of one photo and the inverse depth along it.
#[derive(Debug, Clone)]
pub(super) struct Landmark {
    /// Its photo and place there.
    pub anchor: Observation,
    /// 1/z there.
    pub inverse_depth: f64,
    /// As other photos see it: shared, as scenes are copied in every step of bundle adjustment.
    pub seen: Arc<[Observation]>,
}

/// What is solved for.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    /// `None` where a photo has no place yet.
    pub cameras: Vec<Option<Camera>>,
    /// The focal length in diagonals, where each photo's is the product of this and its share.
    pub focal: f64,
    /// That of every photo.
    pub distortion: Distortion,
    /// The focal lengths' ratios: 1 if nothing is known of any.
    pub shares: Vec<f64>,
    /// The first estimate of the photo's share, where it is an unknown.
    pub estimates: Vec<Option<f64>>,
    /// Pixels per diagonal.
    pub diagonals: Vec<f64>,
    pub landmarks: Vec<Landmark>,
    /// Standard deviation of the places of landmarks, in pixels.
    pub noise: f64,
}

/// How a landmark appears.
pub(super) struct Appearance {
    /// In camera coordinates, but for the scale.
    pub point: Vector3<f64>,
    /// Its error in pixels, without distortion.
    pub error: [f64; 2],
}

impl Appearance {
    /// How far off it is, in pixels.
    pub fn distance(&self) -> f64 {
        let [x, y] = self.error;
        (x * x + y * y).sqrt()
    }
}

impl Scene {
    pub fn new(lenses: &[Lens], focal: &Focal) -> Self {
        Self {
            cameras: vec![None; lenses.len()],
            focal: focal.value,
            distortion: Distortion::default(),
            shares: focal.shares.clone(),
            estimates: focal.estimates.clone(),
            diagonals: lenses.iter().map(|lens| diagonal(lens.size)).collect(),
            landmarks: Vec::new(),
            noise: MOST_NOISE,
        }
    }

    /// The focal length of a photo in its diagonals.
    pub fn focal(&self, photo: usize) -> f64 {
        self.focal * self.shares[photo]
    }

    /// Whether the lens distorts.
    pub fn is_distorted(&self) -> bool {
        self.distortion != Distortion::default()
    }

    /// The ray (x, y, 1) of a place.
    pub fn ray(&self, o: &Observation) -> Vector3<f64> {
        let (f, [x, y]) = (self.focal(o.photo), self.distortion.undistorted(o.place));
        Vector3::new(x / f, y / f, 1.0)
    }

    /// Where a camera sees a landmark; `None` behind it.
    pub fn appearance(&self, landmark: &Landmark, o: &Observation) -> Option<Appearance> {
        let (from, to) = (self.cameras[landmark.anchor.photo].as_ref()?, self.cameras[o.photo].as_ref()?);
        let (rotation, translation) = from.motion_to(to);
        self.error(rotation * self.ray(&landmark.anchor) + translation * landmark.inverse_depth, o)
    }

    /// The error of a point in camera coordinates, but for the scale; `None` behind the camera.
    pub fn error(&self, point: Vector3<f64>, o: &Observation) -> Option<Appearance> {
        if point[2].is_nan() || point[2] <= 1e-9 {
            return None;
        }
        let (f, unit, place) = (self.focal(o.photo), self.diagonals[o.photo], self.distortion.undistorted(o.place));
        let error = [0, 1].map(|k| unit * (f * point[k] / point[2] - place[k]));
        Some(Appearance { point, error })
    }

    /// The distance in pixels of a landmark's image from where it was seen.
    pub fn distance(&self, landmark: &Landmark, o: &Observation) -> f64 {
        self.appearance(landmark, o).map_or(f64::INFINITY, |found| found.distance())
    }

    /// Makes landmarks anew of all tracks that two placed photos or more see within `tolerance` pixels of one point.
    pub fn triangulate(&mut self, tracks: &[Track], tolerance: f64) {
        let landmarks = tracks.iter().filter_map(|track| self.landmark(track, tolerance)).collect();
        self.landmarks = landmarks;
    }

    fn landmark(&self, track: &Track, tolerance: f64) -> Option<Landmark> {
        let placed: Vec<Observation> = track.iter().filter(|o| self.cameras[o.photo].is_some()).copied().collect();
        let (anchor, seen) = placed.split_first()?;
        let found = Landmark { anchor: *anchor, inverse_depth: self.depth(anchor, seen)?, seen: Arc::default() };
        let seen: Arc<_> = seen.iter().filter(|o| self.distance(&found, o) < tolerance).copied().collect();
        (!seen.is_empty()).then_some(Landmark { seen, ..found })
    }

    /// The inverse depth of a landmark that suits all who see it, by linear least squares.
    fn depth(&self, anchor: &Observation, seen: &[Observation]) -> Option<f64> {
        let ray = self.ray(anchor);
        let from = self.cameras[anchor.photo].as_ref()?;
        let (mut square, mut product) = (0.0, 0.0);
        for o in seen {
            let (rotation, t) = from.motion_to(self.cameras[o.photo].as_ref()?);
            let (far, seen) = (rotation * ray, self.ray(o));
            for k in 0..2 {
                let x = seen[k];
                let slope = t[k] - x * t[2];
                square += slope * slope;
                product += slope * (x * far[2] - far[k]);
            }
        }
        // Turned cameras say nothing of depth, and need none.
        Some(if square > 1e-14 { product / square } else { 0.0 })
    }

    /// Estimates the noise by the errors as they are.
    pub fn estimate_noise(&mut self) {
        if let Some(noise) = self.residual_noise() {
            self.noise = noise.clamp(LEAST_NOISE, MOST_NOISE);
        }
    }

    /// The noise by the errors as they are; `None` without landmarks.
    pub fn residual_noise(&self) -> Option<f64> {
        let errors =
            self.landmarks.iter().flat_map(|landmark| landmark.seen.iter().map(|o| self.distance(landmark, o)));
        median(errors.collect()).map(|error| error / RAYLEIGH_MEDIAN)
    }

    /// How many observations of landmarks are close to where the cameras see them, beside those that landmarks are anchored to. Nothing is
    /// farther than infinitely far: cameras that moved the other way would see the same behind them.
    pub fn explained(&self) -> usize {
        let close = |landmark: &Landmark| {
            let possible = Landmark {
                anchor: landmark.anchor,
                inverse_depth: landmark.inverse_depth.max(0.0),
                seen: Arc::default(),
            };
            let is_close = |o: &&Observation| self.distance(&possible, o) < EXPLAINED * self.diagonals[o.photo];
            landmark.seen.iter().filter(is_close).count()
        };
        self.landmarks.iter().map(close).sum()
    }

    /// The mean square error of `all` observations, where those that are not explained have the most that explained ones may have.
    pub fn cost(&self, all: usize) -> f64 {
        let noise = self.residual_noise().unwrap_or(0.0);
        let most = EXPLAINED * self.diagonals.iter().sum::<f64>() / self.diagonals.len() as f64;
        let share = (self.explained() as f64 / all.max(1) as f64).min(1.0);
        share * noise * noise + (1.0 - share) * most * most
    }

    /// The median inverse depth of the landmarks.
    pub fn median_inverse_depth(&self) -> Option<f64> {
        median(self.landmarks.iter().map(|landmark| landmark.inverse_depth).collect())
    }

    /// Scales the scene so that the median inverse depth is 1.
    pub fn normalise(&mut self) {
        if let Some(depth) = self.median_inverse_depth() {
            self.scale(depth);
        }
    }

    /// Makes the scene so many times larger, unless that is impossible.
    pub fn scale(&mut self, scale: f64) {
        if !(scale > 0.0 && scale.is_normal()) {
            return;
        }
        self.landmarks.iter_mut().for_each(|landmark| landmark.inverse_depth /= scale);
        self.cameras.iter_mut().flatten().for_each(|camera| camera.translation *= scale);
    }

    /// The model from one photo to another, in pixels; its inverse depth is 1/z. `None` unless both have a place.
    pub fn model(&self, lenses: &[Lens], [from, to]: [usize; 2]) -> Option<Model> {
        let (rotation, translation) = self.cameras[from].as_ref()?.motion_to(self.cameras[to].as_ref()?);
        let [_, back] = lenses[from].calibration(self.focal(from));
        let [k, _] = lenses[to].calibration(self.focal(to));
        Some(Model { h: (k * (rotation * back)), e: k * translation })
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// Two cameras a step apart, and what they see at several depths.
    #[test]
    fn what_would_be_behind_the_cameras_is_not_explained() {
        let lenses = [Lens { size: (800, 600), focal: None }; 2];
        let focal = Focal { shares: vec![1.0; 2], estimates: vec![None; 2], value: 0.9, prior: [0.0, 1.0] };
        let mut scene = Scene::new(&lenses, &focal);
        let at = |x: f64| Some(Camera { rotation: Matrix3::identity(), translation: Vector3::new(x, 0.0, 0.0) });
        scene.cameras = vec![at(0.0), at(0.1)];
        let track = |i: usize| {
            let (place, depth) = ([0.05 * i as f64 - 0.2, 0.1], 0.2 * i as f64);
            let seen = [place[0] + 0.9 * 0.1 * depth, place[1]];
            vec![Observation { photo: 0, place }, Observation { photo: 1, place: seen }]
        };
        let tracks: Vec<Track> = (0..8).map(track).collect();
        scene.triangulate(&tracks, 1.0);
        assert_eq!(scene.explained(), 8);
        assert!(scene.cost(8) < 1e-9, "{}", scene.cost(8));
        assert!((scene.cost(10) - 0.2 * (EXPLAINED * 1000.0).powi(2)).abs() < 1e-6, "{}", scene.cost(10));
        // The other way: only what is infinitely far is as well there.
        scene.cameras = vec![at(0.0), at(-0.1)];
        scene.triangulate(&tracks, 1.0);
        assert_eq!((scene.landmarks.len(), scene.explained()), (8, 1));
    }
}
