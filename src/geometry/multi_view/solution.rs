//! The geometry that was found for several photos, and what it says of them.

use nalgebra::{Matrix3, Vector3};

use super::bundle::FreeParameters;
use super::growth::{LANDMARKS, finish, finish_rotations};
use super::homographies::Chain;
use super::resection::TOLERANCE;
use super::scene::{Camera, Scene};
use super::self_calibration::calibrate;
use super::tracks::{Observation, Track, select_tracks, tracks};
use super::{Lens, PairLink};
use crate::geometry::{DepthSample, Distortion, Model};
use crate::rect::diagonal;
use crate::statistics::median;

/// Cameras closer together than this share of how far from the origin they are stand in one place: the rest is rounding.
const ONE_PLACE: f64 = 1e-9;
/// A photo needs so many exact places to be adjusted to them alone.
const FEWEST_EXACT: usize = 20;

/// What the photos were found to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MultiViewKind {
    /// Cameras in different places.
    Cameras,
    /// Cameras that turned in one place, or as good as.
    Rotations,
    /// Photos of a plane, or of whatever homographies explain best.
    Homographies,
}

/// One geometry of several photos.
#[derive(Debug, Clone)]
pub struct MultiView {
    /// What was found.
    pub kind: MultiViewKind,
    /// Pairs that take no part as they contradict the others, by their index.
    pub contradicting: Vec<usize>,
    /// Whether the cameras are known, and stay as they are.
    pub(super) given: bool,
    pub(super) lenses: Vec<Lens>,
    /// Of the logarithm of the focal length.
    pub(super) prior: [f64; 2],
    pub(super) solved: Solved,
    /// Cameras that only turned, if they explain about as much.
    pub(super) turned: Option<Box<Scene>>,
}

#[derive(Debug, Clone)]
pub(super) enum Solved {
    Scene(Box<Scene>),
    Chain { chain: Chain, links: Vec<PairLink> },
}

/// A point that two photos show.
#[derive(Debug, Clone, Copy)]
pub struct ObservedPair {
    /// Their indices.
    pub photos: [usize; 2],
    /// Where either shows it, in pixels.
    pub places: [[f64; 2]; 2],
    /// Its inverse depth in the first.
    pub depth: f64,
}

impl MultiView {
    /// Cameras that are known, one per lens, each of which has its focal length: `links` only make landmarks.
    pub fn given(lenses: &[Lens], cameras: &[Camera], links: &[PairLink]) -> Self {
        let focal = calibrate(lenses, links);
        let mut scene = Scene::new(lenses, &focal);
        scene.cameras = cameras.iter().copied().map(Some).collect();
        scene.triangulate(&tracks(lenses, links), TOLERANCE);
        let farthest = cameras.iter().map(|camera| camera.translation.norm()).fold(0.0, f64::max);
        let moved = cameras.iter().any(|camera| camera.motion_to(&cameras[0]).1.norm() > ONE_PLACE * farthest);
        let kind = if moved { MultiViewKind::Cameras } else { MultiViewKind::Rotations };
        let solved = Solved::Scene(Box::new(scene));
        Self {
            kind,
            contradicting: Vec::new(),
            given: true,
            lenses: lenses.to_vec(),
            prior: focal.prior,
            solved,
            turned: None,
        }
    }

    /// Whether the cameras were known before.
    pub fn is_given(&self) -> bool {
        self.given
    }

    /// The distortion of the photos' lens; `None` where there is none to speak of.
    pub fn distortion(&self) -> Option<Distortion> {
        let Solved::Scene(scene) = &self.solved else { return None };
        scene.is_distorted().then_some(scene.distortion)
    }

    /// The same of photos that are `factor` times as large, in frames of these sizes around the same middles.
    pub fn resized(mut self, frames: &[(usize, usize)], factor: f64) -> Self {
        self.reframe(frames, factor);
        self
    }

    fn reframe(&mut self, frames: &[(usize, usize)], factor: f64) {
        // What lengths in diagonals become.
        let ratio = |(lens, &frame): (&Lens, &(usize, usize))| factor * diagonal(lens.size) / diagonal(frame);
        let ratios: Vec<f64> = self.lenses.iter().zip(frames).map(ratio).collect();
        self.lenses.iter_mut().zip(frames).for_each(|(lens, &frame)| lens.size = frame);
        let solved = match &mut self.solved {
            Solved::Scene(scene) => Some(scene),
            Solved::Chain { chain, .. } => {
                for (to_root, ratio) in chain.to_root.iter_mut().zip(&ratios) {
                    *to_root =
                        to_root.map(|h| h * Matrix3::from_diagonal(&Vector3::new(1.0 / ratio, 1.0 / ratio, 1.0)));
                }
                None
            }
        };
        for scene in [solved, self.turned.as_mut()].into_iter().flatten() {
            scene.diagonals = self.lenses.iter().map(|lens| diagonal(lens.size)).collect();
            for (photo, ratio) in ratios.iter().enumerate() {
                scene.shares[photo] *= ratio;
                scene.estimates[photo] = scene.estimates[photo].map(|estimate| estimate * ratio);
            }
        }
    }

    /// Goes on with the photos without distortion: the sizes of their frames, and the matches between these.
    pub fn undistort(&mut self, frames: &[(usize, usize)], links: &[PairLink]) {
        self.reframe(frames, 1.0);
        let Solved::Scene(scene) = &mut self.solved else { return };
        scene.distortion = Distortion::default();
        scene.triangulate(&tracks(&self.lenses, links), TOLERANCE);
        self.adjust_turned(links);
    }

    /// Goes on with cameras that only turned instead of those in different places, if they explain about as much; whether it does.
    pub fn ignore_parallax(&mut self) -> bool {
        let turned = if self.kind == MultiViewKind::Cameras { self.turned.take() } else { None };
        let Some(turned) = turned else { return false };
        (self.kind, self.solved) = (MultiViewKind::Rotations, Solved::Scene(turned));
        true
    }

    /// Adjusts the cameras that only turned to `links` anew, of photos without distortion.
    pub(super) fn adjust_turned(&mut self, links: &[PairLink]) {
        if let Some(turned) = &mut self.turned
            && let Some(first) = turned.cameras.iter().position(Option::is_some)
        {
            turned.distortion = Distortion::default();
            finish_rotations(turned, &tracks(&self.lenses, links), first, self.prior);
        }
    }

    /// Adjusts cameras in different places to other matches between the same photos: to enough of them for [`MultiView::refine_observations`].
    pub fn refine(&mut self, links: &[PairLink]) {
        let tracks = tracks(&self.lenses, links);
        let enough = select_tracks(&tracks, self.lenses.len(), LANDMARKS);
        self.adjust_to(&enough);
        if enough.len() < tracks.len()
            && let (Solved::Scene(scene), MultiViewKind::Cameras) = (&mut self.solved, self.kind)
        {
            scene.triangulate(&tracks, TOLERANCE);
        }
    }

    /// Adjusts the cameras once more when `locate` has said where exactly photos show what others do: to these places alone, as
    /// long as each photo has some.
    pub fn refine_observations(&mut self, locate: &mut dyn FnMut(&ObservedPair) -> Option<[f64; 2]>) {
        let Solved::Scene(scene) = &self.solved else { return };
        let (mut all, mut exact) = (Vec::new(), Vec::new());
        let mut counts = vec![0; self.lenses.len()];
        for landmark in &scene.landmarks {
            let anchor = landmark.anchor;
            let mut tracks = [vec![anchor], vec![anchor]];
            for o in landmark.seen.iter() {
                let sides = [anchor, *o].map(|o| (o.photo, self.lenses[o.photo].pixel(o.place)));
                let observed = ObservedPair {
                    photos: sides.map(|s| s.0),
                    places: sides.map(|s| s.1),
                    depth: landmark.inverse_depth,
                };
                let place = locate(&observed).map(|place| self.lenses[o.photo].centred(place));
                tracks[0].push(Observation { place: place.unwrap_or(o.place), ..*o });
                if let Some(place) = place {
                    tracks[1].push(Observation { place, ..*o });
                    counts[o.photo] += 1;
                    counts[anchor.photo] += 1;
                }
            }
            let [one, other] = tracks;
            all.push(one);
            exact.extend(Some(other).filter(|track| track.len() > 1));
        }
        let enough = |(count, camera): (&usize, &Option<Camera>)| camera.is_none() || *count >= FEWEST_EXACT;
        if counts.iter().zip(&scene.cameras).all(enough) {
            self.adjust_to(&exact);
            if let Solved::Scene(scene) = &mut self.solved {
                scene.triangulate(&all, TOLERANCE);
            }
        }
    }

    fn adjust_to(&mut self, tracks: &[Track]) {
        if let (Solved::Scene(scene), MultiViewKind::Cameras) = (&mut self.solved, self.kind)
            && let Some(first) = scene.cameras.iter().position(Option::is_some)
        {
            if self.given {
                scene.triangulate(tracks, TOLERANCE);
            } else {
                finish(scene, tracks, first, FreeParameters::POSES, self.prior);
            }
        }
    }

    /// Whether a photo has a place.
    pub fn is_placed(&self, photo: usize) -> bool {
        match &self.solved {
            Solved::Scene(scene) => scene.cameras[photo].is_some(),
            Solved::Chain { chain, .. } => chain.to_root[photo].is_some(),
        }
    }

    /// The cameras; with homographies those that explain them roughly, if there are any.
    fn cameras(&self) -> Option<&Scene> {
        match &self.solved {
            Solved::Scene(scene) => Some(scene),
            Solved::Chain { .. } => self.turned.as_deref(),
        }
    }

    /// The camera of a photo; `None` without a place. With homographies it is an approximation, if there is one.
    pub fn camera(&self, photo: usize) -> Option<Camera> {
        self.cameras()?.cameras[photo]
    }

    /// The focal length of a photo in pixels; as [`MultiView::camera`].
    pub fn focal(&self, photo: usize) -> Option<f64> {
        self.cameras().map(|scene| scene.focal(photo) * scene.diagonals[photo])
    }

    /// From rays in a camera's axes to its photo's pixels, and back; as [`MultiView::camera`].
    pub fn calibration(&self, photo: usize) -> Option<[Matrix3<f64>; 2]> {
        self.cameras().map(|scene| self.lenses[photo].calibration(scene.focal(photo)))
    }

    /// The map from one photo to another, in pixels, d being 1/z in the cameras' unit. `None` unless both have a place.
    pub fn model(&self, photos: [usize; 2]) -> Option<Model> {
        if photos[0] == photos[1] {
            return self.is_placed(photos[0]).then(|| Model::homography(Matrix3::identity()));
        }
        match &self.solved {
            Solved::Scene(scene) => {
                let model = scene.model(&self.lenses, photos)?;
                Some(if self.kind == MultiViewKind::Rotations { Model::homography(model.h) } else { model })
            }
            Solved::Chain { chain, .. } => {
                let [from, to] = photos.map(|photo| &self.lenses[photo]);
                Some(Model::homography(to.to_pixels() * (chain.between(photos)? * from.to_centred())))
            }
        }
    }

    /// Landmarks as a photo sees them, with their inverse depth there; the parallax is that in photo `other`. None without
    /// parallax.
    pub fn samples(&self, photo: usize, other: usize) -> Vec<DepthSample> {
        let (Solved::Scene(scene), MultiViewKind::Cameras) = (&self.solved, self.kind) else { return Vec::new() };
        let (Some(model), lens) = (self.model([photo, other]), &self.lenses[photo]) else { return Vec::new() };
        let mut samples = Vec::new();
        for landmark in &scene.landmarks {
            let found = if landmark.anchor.photo == photo {
                Some((landmark.anchor.place, landmark.inverse_depth))
            } else {
                let seen = landmark.seen.iter().find(|o| o.photo == photo);
                seen.and_then(|o| Some((o.place, landmark.inverse_depth / scene.appearance(landmark, o)?.point[2])))
            };
            if let Some((place, depth)) = found {
                let point = lens.pixel(place);
                let parallax = model.parallax(point, depth);
                if depth.is_finite() && parallax.is_normal() {
                    samples.push(DepthSample { point, depth, parallax });
                }
            }
        }
        samples
    }

    /// The median error of a photo's matches in pixels; `None` without any.
    pub fn error(&self, photo: usize) -> Option<f64> {
        let mut errors = Vec::new();
        match &self.solved {
            Solved::Scene(scene) => {
                for landmark in &scene.landmarks {
                    for o in landmark.seen.iter().filter(|o| o.photo == photo || landmark.anchor.photo == photo) {
                        errors.push(scene.distance(landmark, o));
                    }
                }
            }
            Solved::Chain { links, .. } => {
                for link in links.iter().filter(|link| link.photos.contains(&photo)) {
                    let Some(model) = self.model(link.photos) else { continue };
                    errors.extend(link.matches.iter().filter_map(|m| model.transfer_error(m.target, 0.0, m.reference)));
                }
            }
        }
        median(errors)
    }
}
