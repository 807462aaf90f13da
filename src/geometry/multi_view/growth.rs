//! Positions of the cameras, one photo after another: rotations are known from averaging, so that two landmarks place a
//! camera.

use nalgebra::{Matrix3, Vector3};

use super::Lens;
use super::bundle::{FreeParameters, adjust};
use super::relative_pose::RelativePose;
use super::resection::{LandmarkObservation, TOLERANCE, resect};
use super::scene::{Camera, Landmark, Scene};
use super::self_calibration::Focal;
use super::tracks::{Track, select_tracks};
use crate::sampler::Sampler;
use crate::statistics::median;

/// Fewer landmarks do not place a camera.
const FEWEST: usize = 8;
/// Landmarks within this of where they are seen, in pixels, while cameras are still badly placed.
const LOOSE: f64 = 12.0;
/// Iterations of bundle adjustment as photos are added, and at the end.
const SOME: usize = 8;
const MANY: usize = 60;
/// All cameras are adjusted when there are so many times more of them than last time: for few photos after each, for many so rarely that
/// the work of it all is in proportion to their number.
const GROWTH: f64 = 1.14;
/// Landmarks a photo that take part before the last adjustment: more say little that these do not.
pub(super) const LANDMARKS: usize = 500;

/// A scene of the photos that `rotations` connect with the root; `None` without a pair that shows parallax.
pub(super) fn grow(
    lenses: &[Lens],
    focal: &Focal,
    tracks: &[Track],
    poses: &[RelativePose],
    rotations: &[Option<Matrix3<f64>>],
) -> Option<Scene> {
    let mut scene = Scene::new(lenses, focal);
    let start = start(&scene, tracks, poses, rotations)?;
    let [first, second] = start.photos;
    let direction = start.direction?;
    scene.cameras[first] = rotations[first].map(Camera::turned);
    // The motion is (R, t) = (R₂R₁ᵀ, t₂ − R t₁) with t₁ = 0.
    scene.cameras[second] = rotations[second].map(|rotation| Camera { rotation, translation: direction });
    let all = tracks;
    let tracks = &select_tracks(all, lenses.len(), LANDMARKS)[..];
    scene.triangulate(tracks, LOOSE);
    scene.normalise();
    adjust(&mut scene, first, FreeParameters::POSES, focal.prior, SOME);
    let mut sampler = Sampler::new(1);
    let mut refused = vec![false; lenses.len()];
    let (mut placed, mut adjusted) = (2, 2);
    loop {
        scene.triangulate(tracks, LOOSE);
        scene.normalise();
        let Some(photo) = next(&scene, tracks, rotations, &refused) else { break };
        let rotation = rotations[photo]?;
        let observations = observations(&scene, tracks, photo);
        let found = resect(&scene, &rotation, &observations, &mut sampler).filter(|(_, close)| *close >= FEWEST);
        let camera = match found {
            Some((camera, _)) => Some(camera),
            None => by_direction(&scene, tracks, poses, rotation, photo),
        };
        let Some(camera) = camera else {
            refused[photo] = true;
            continue;
        };
        scene.cameras[photo] = Some(camera);
        placed += 1;
        if f64::from(placed) >= GROWTH * f64::from(adjusted) {
            adjusted = placed;
            scene.triangulate(tracks, LOOSE);
            scene.normalise();
            adjust(&mut scene, first, FreeParameters::POSES, focal.prior, SOME);
        }
    }
    finish(&mut scene, all, first, FreeParameters::POSES, focal.prior);
    Some(scene)
}

/// A scene that starts from cameras that were found to turn, as if held at arm's length: each is one unit ahead, along its optical axis, of
/// the point that all turn around; or behind it, if else most landmarks would be farther than infinitely far. One photo after another, what is
/// wrong with each would add up along a full turn.
pub(super) fn around(turned: &Scene, tracks: &[Track], root: usize, free: FreeParameters, prior: [f64; 2]) -> Scene {
    let mut scene = turned.clone();
    scene.cameras.iter_mut().flatten().for_each(|camera| camera.translation = -Vector3::z());
    scene.triangulate(&select_tracks(tracks, scene.cameras.len(), LANDMARKS), LOOSE);
    if scene.median_inverse_depth().is_some_and(|depth| depth < 0.0) {
        scene.cameras.iter_mut().flatten().for_each(|camera| camera.translation = Vector3::z());
    }
    finish(&mut scene, tracks, root, free, prior);
    scene
}

/// Bundle adjustment of a scene that is coarse.
pub(super) fn finish(scene: &mut Scene, tracks: &[Track], root: usize, free: FreeParameters, prior: [f64; 2]) {
    // Rotations alone are a coarse initial estimate.
    let first = if free.positions { LOOSE } else { 10.0 * LOOSE };
    adjust_to_inliers(scene, tracks, &[first, 0.3 * first, 2.0 * TOLERANCE, TOLERANCE], root, free, prior);
}

/// Bundle adjustment, one time after another of enough of the landmarks that are inliers at one of these `tolerances`, and at last of all at the
/// last one.
pub(super) fn adjust_to_inliers(
    scene: &mut Scene,
    tracks: &[Track],
    tolerances: &[f64],
    root: usize,
    free: FreeParameters,
    prior: [f64; 2],
) {
    let few = select_tracks(tracks, scene.cameras.len(), LANDMARKS);
    let triangulate = |scene: &mut Scene, tracks: &[Track], tolerance: f64| {
        scene.triangulate(tracks, tolerance);
        if free.positions {
            scene.normalise();
        }
    };
    let last = tolerances.last().copied().unwrap_or(TOLERANCE);
    // Even where these are all: the noise is that of the step before.
    let steps = tolerances.iter().map(|tolerance| (*tolerance, &few[..])).chain([(last, tracks)]);
    for (tolerance, tracks) in steps {
        triangulate(scene, tracks, tolerance);
        adjust(scene, root, free, prior, MANY);
        scene.estimate_noise();
    }
    triangulate(scene, tracks, last);
}

/// The same as [`finish`] of cameras that only turned: of enough landmarks for their few unknowns.
pub(super) fn finish_rotations(scene: &mut Scene, tracks: &[Track], root: usize, prior: [f64; 2]) {
    let enough = select_tracks(tracks, scene.cameras.len(), LANDMARKS);
    finish(scene, &enough, root, FreeParameters::ROTATIONS, prior);
    scene.triangulate(tracks, TOLERANCE);
}

/// The pair to start from: of many matches that move by much.
fn start<'a>(
    scene: &Scene,
    tracks: &[Track],
    poses: &'a [RelativePose],
    rotations: &[Option<Matrix3<f64>>],
) -> Option<&'a RelativePose> {
    let mut best: Option<(f64, &RelativePose)> = None;
    for pose in poses {
        let [a, b] = pose.photos;
        let (Some(from), Some(to), Some(_)) = (rotations[a], rotations[b], pose.direction) else { continue };
        let turn = to * from.transpose();
        let mut moved = Vec::new();
        for track in tracks {
            let end = |photo: usize| track.iter().find(|o| o.photo == photo);
            if let (Some(one), Some(other)) = (end(a), end(b))
                && let Some(found) = scene.error(turn * scene.ray(one), other)
            {
                moved.push(found.distance());
            }
        }
        let count = moved.len() as f64;
        let Some(parallax) = median(moved) else { continue };
        // Beyond some 40 pixels more parallax helps little.
        let value = count.min(500.0) * parallax.min(40.0);
        if best.is_none_or(|(most, _)| value > most) {
            best = Some((value, pose));
        }
    }
    best.map(|(_, pose)| pose)
}

/// The photo without a place that sees most landmarks; any that is connected at last.
fn next(scene: &Scene, tracks: &[Track], rotations: &[Option<Matrix3<f64>>], refused: &[bool]) -> Option<usize> {
    let mut counts = vec![0usize; rotations.len()];
    for track in tracks {
        let placed = track.iter().filter(|o| scene.cameras[o.photo].is_some()).count();
        for o in track.iter().filter(|o| scene.cameras[o.photo].is_none()) {
            // Two that have placed it count much more than one that shares it.
            counts[o.photo] += if placed >= 2 { 1000 } else { placed };
        }
    }
    let open = |photo: &usize| rotations[*photo].is_some() && scene.cameras[*photo].is_none() && !refused[*photo];
    let found = (0..rotations.len()).filter(open).max_by_key(|photo| (counts[*photo], usize::MAX - photo))?;
    (counts[found] > 0).then_some(found)
}

/// The landmarks that a photo sees.
fn observations(scene: &Scene, tracks: &[Track], photo: usize) -> Vec<LandmarkObservation> {
    // A landmark knows its anchor; the photo's own observation is in the track with that observation.
    let mut found = Vec::new();
    let mut landmarks = scene.landmarks.iter();
    let mut landmark: Option<&Landmark> = landmarks.next();
    for track in tracks {
        let Some(current) = landmark else { break };
        if !track.contains(&current.anchor) {
            continue;
        }
        if let Some(o) = track.iter().find(|o| o.photo == photo)
            && let Some(observation) = LandmarkObservation::new(scene, &current.anchor, current.inverse_depth, *o)
        {
            found.push(observation);
        }
        landmark = landmarks.next();
    }
    found
}

/// A camera that shares no landmark with two others: where its best pair says, at such a distance that what they share is as
/// far as what is known already.
fn by_direction(
    scene: &Scene,
    tracks: &[Track],
    poses: &[RelativePose],
    rotation: Matrix3<f64>,
    photo: usize,
) -> Option<Camera> {
    let mut best: Option<(&RelativePose, usize)> = None;
    for pose in poses.iter().filter(|pose| pose.photos.contains(&photo)) {
        let other = if pose.photos[0] == photo { pose.photos[1] } else { pose.photos[0] };
        if scene.cameras[other].is_some() && best.is_none_or(|(known, _)| pose.weight > known.weight) {
            best = Some((pose, other));
        }
    }
    let (pose, other) = best?;
    let neighbour = scene.cameras[other]?;
    let Some(direction) = pose.direction else {
        // It only turned: it stands where the other stands.
        let turn = rotation * neighbour.rotation.transpose();
        return Some(Camera { rotation, translation: turn * neighbour.translation });
    };
    // Of length 1, from the neighbour to this photo.
    let turn = rotation * neighbour.rotation.transpose();
    let motion = if pose.photos[0] == photo { -(turn * direction) } else { direction };
    let at = |length: f64| Camera { rotation, translation: turn * neighbour.translation + motion * length };
    let mut trial = scene.clone();
    trial.cameras.iter_mut().enumerate().for_each(|(i, camera)| {
        if i != other {
            *camera = None;
        }
    });
    trial.cameras[photo] = Some(at(1.0));
    trial.triangulate(tracks, LOOSE);
    let inverse = trial.median_inverse_depth()?;
    // The median inverse depth of what is known is 1. Where theirs is none, nothing says that they are apart.
    Some(at(if inverse > 0.0 && inverse.is_normal() { inverse } else { 0.0 }))
}
