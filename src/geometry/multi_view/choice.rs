//! Which geometry explains all photos: cameras with parallax, cameras that turned, or homographies.

use super::bundle::FreeParameters;
use super::growth::{around, finish_rotations, grow};
use super::homographies::Chain;
use super::lens::with_distortion;
use super::lens_ratios::{calibrate_each, keeps_ratios};
use super::loops::{Rotations, close_loops};
use super::relative_pose::{relative_pose, turn};
use super::rotations::{are_wide, average};
use super::scene::{Camera, EXPLAINED, Scene};
use super::self_calibration::{Focal, calibrate};
use super::solution::{MultiView, MultiViewKind, Solved};
use super::tracks::{Track, count_observations, tracks};
use super::{Lens, PairLink};

/// Cameras that only turned and explain this share of what others do may take their place if that looks better; of what homographies do, they may say what to
/// show photos on: those of photos that did turn explain 0.83 and more on the real sets, those of flat scenes 0.41 and less.
const ROUGHLY: f64 = 0.7;
/// Cameras explain the photos better than others at this share of their cost.
const CLEARLY: f64 = 0.8;
/// Cameras that turned explain as much as others if it is this share.
const AS_MUCH: f64 = 0.98;
/// Cameras that explain less than this share of all observations are not the right ones.
const POORLY: f64 = 0.9;
/// Cameras that explain this share of all observations need no others beside them.
const COMPLETE: f64 = 0.99;

/// What cameras are found from.
struct Pairs<'a> {
    lenses: &'a [Lens],
    links: &'a [PairLink],
    root: usize,
    /// A photo that has to have a place.
    reference: Option<usize>,
    may_distort: bool,
    /// How many observations tracks have beyond their first, if no pair contradicts the others.
    observations: usize,
}

/// Cameras that explain the photos.
struct Candidate {
    scene: Scene,
    /// Pairs that take no part, by their index.
    contradicting: Vec<usize>,
    /// Share of all observations that it explains.
    explained: f64,
    /// Mean square error of all observations, in pixels.
    cost: f64,
}

/// Finds the geometry of photos that `links` connect with each other, of which the `reference` always has a place; and the lens'
/// distortion, if it `may_distort`.
pub fn multi_view(lenses: &[Lens], links: &[PairLink], reference: Option<usize>, may_distort: bool) -> MultiView {
    let root = reference.or(links.iter().map(|link| link.photos[0]).min()).unwrap_or(0);
    let observations = count_observations(&tracks(lenses, links));
    let pairs = Pairs { lenses, links, root, reference, may_distort, observations };
    let focal = calibrate(lenses, links);
    let prior = focal.prior;
    let own = calibrate_each(lenses, links, &focal);
    let (mut grown, mut turned) = pairs.candidates(focal);
    if let Some(focal) = own {
        let own = pairs.candidates(focal);
        let credible = |own: &Candidate| keeps_ratios(&own.scene);
        let better = |own: &Candidate| credible(own) && grown.as_ref().is_none_or(|common| own.is_better(common));
        grown = own.0.filter(better).or(grown);
        turned = if credible(&own.1) && own.1.is_better(&turned) { own.1 } else { turned };
    }
    let chain = Chain::of(lenses, links, &turned.scene.diagonals, root);
    let mut found = choose(lenses, links, prior, (grown, turned, chain));
    let straight = found.kind == MultiViewKind::Cameras && found.distortion().is_none();
    if straight && found.turned.as_ref().is_some_and(|turned| turned.is_distorted()) {
        found.adjust_turned(&pairs.consistent(&found.contradicting));
    }
    found
}

impl Pairs<'_> {
    /// With these focal lengths: cameras in different places, if there are any, and cameras that only turned.
    fn candidates(&self, focal: Focal) -> (Option<Candidate>, Candidate) {
        let (lenses, links, root) = (self.lenses, self.links, self.root);
        let lacks_reference =
            |grown: &Candidate| self.reference.is_some_and(|photo| grown.scene.cameras[photo].is_none());
        let posed = self.posed(&focal);
        let mut grown = self.grown(&focal, &posed);
        if grown.as_ref().is_some_and(|grown| grown.explained < POORLY) {
            // Bundle adjustment ends in the minimum that is next.
            for focal in focal.alternatives() {
                let other = self.grown(&focal, &self.posed(&focal));
                let better = |other: &Candidate| grown.as_ref().is_none_or(|grown| other.is_better(grown));
                grown = other.filter(better).or(grown);
            }
        }
        let incomplete = grown.as_ref().is_some_and(lacks_reference);
        let mut grown = grown.filter(|_| !incomplete);
        let closed = close_loops(lenses, links, &focal, posed.contradicting.len(), root);
        let (focal, turns) = closed.unwrap_or((focal, posed));
        let turned = self.turned(&focal, &turns.contradicting);
        // One photo after another, small errors add up, and a photo may find no place; but not every camera turned.
        let doubtful = grown.as_ref().map_or(incomplete || turned.is_wide(), |grown| grown.explained < COMPLETE);
        if doubtful {
            let around = self.around(&turned, focal.prior);
            grown = grown.filter(|grown| grown.cost <= around.cost).or(Some(around));
        }
        (grown, turned)
    }

    /// The relative poses and rotations with these focal lengths.
    fn posed(&self, focal: &Focal) -> Rotations {
        let poses = self.links.iter().map(|link| relative_pose(link, self.lenses, focal.of(link.photos)));
        Rotations::of(poses.collect(), self.lenses.len(), self.root)
    }

    fn consistent(&self, contradicting: &[usize]) -> Vec<PairLink> {
        let all = self.links.iter().enumerate();
        all.filter(|(i, _)| !contradicting.contains(i)).map(|(_, link)| link.clone()).collect()
    }

    /// Cameras that only turned.
    fn turned(&self, focal: &Focal, contradicting: &[usize]) -> Candidate {
        let (lenses, links) = (self.lenses, self.consistent(contradicting));
        let turns = links.iter().filter_map(|link| turn(link, lenses, focal.of(link.photos)));
        let rotations = average(&turns.collect::<Vec<_>>(), lenses.len(), self.root);
        let mut scene = Scene::new(lenses, focal);
        for (camera, rotation) in scene.cameras.iter_mut().zip(rotations) {
            *camera = rotation.map(Camera::turned);
        }
        let tracks = tracks(lenses, &links);
        finish_rotations(&mut scene, &tracks, self.root, focal.prior);
        self.candidate(scene, &tracks, contradicting, FreeParameters::ROTATIONS, focal.prior)
    }

    /// Cameras in different places.
    fn grown(&self, focal: &Focal, rotations: &Rotations) -> Option<Candidate> {
        let tracks = tracks(self.lenses, &self.consistent(&rotations.contradicting));
        let scene = grow(self.lenses, focal, &tracks, &rotations.poses, &rotations.photos)?;
        Some(self.candidate(scene, &tracks, &rotations.contradicting, FreeParameters::POSES, focal.prior))
    }

    /// Cameras in different places around the one that others turned in.
    fn around(&self, turned: &Candidate, prior: [f64; 2]) -> Candidate {
        let tracks = tracks(self.lenses, &self.consistent(&turned.contradicting));
        let free = FreeParameters { distortion: self.may_distort, ..FreeParameters::POSES };
        let scene = around(&turned.scene, &tracks, self.root, free, prior);
        // Parallax looks like distortion to cameras in one place, but seldom the other way round.
        let free = FreeParameters { distortion: turned.scene.is_distorted(), ..FreeParameters::POSES };
        self.candidate(scene, &tracks, &turned.contradicting, free, prior)
    }

    /// Of a finished scene, which gets the distortion of its lens; `free` says whether there is one unless the matches contradict it.
    fn candidate(
        &self,
        mut scene: Scene,
        tracks: &[Track],
        contradicting: &[usize],
        free: FreeParameters,
        prior: [f64; 2],
    ) -> Candidate {
        if self.may_distort {
            scene = with_distortion(scene, tracks, self.root, free, prior);
        }
        let explained = scene.explained() as f64 / self.observations.max(1) as f64;
        let cost = scene.cost(self.observations);
        Candidate { scene, contradicting: contradicting.to_vec(), explained, cost }
    }
}

impl Candidate {
    /// Whether it explains the photos clearly better than another does.
    fn is_better(&self, other: &Self) -> bool {
        self.cost < CLEARLY * other.cost
    }

    fn is_wide(&self) -> bool {
        let rotations = self.scene.cameras.iter().map(|camera| camera.map(|camera| camera.rotation));
        are_wide(&rotations.collect::<Vec<_>>())
    }
}

fn choose(
    lenses: &[Lens],
    links: &[PairLink],
    prior: [f64; 2],
    (grown, turned, chain): (Option<Candidate>, Candidate, Chain),
) -> MultiView {
    let (by_turning, by_chain) = (turned.explained, explained_by_chain(&chain, lenses, links));
    // Homographies show only what is before all cameras.
    let wide = turned.is_wide() && by_turning >= ROUGHLY * by_chain;
    // To different places and depth the distortion of a lens in one place looks like parallax.
    let distorted = turned.scene.is_distorted();
    let least = if wide { by_turning } else { by_chain };
    let chosen = |grown: &Candidate| grown.explained > least && !(distorted && by_turning >= AS_MUCH * grown.explained);
    let (kind, contradicting, solved, turned) = match grown.filter(chosen) {
        Some(Candidate { scene, contradicting, explained, .. }) => {
            let mut places = scene.cameras.iter().zip(&turned.scene.cameras);
            let as_many = places.all(|(camera, turned)| camera.is_none() || turned.is_some());
            let roughly = as_many && by_turning >= ROUGHLY * explained;
            let turned = roughly.then_some(turned.scene);
            (MultiViewKind::Cameras, contradicting, Solved::Scene(Box::new(scene)), turned)
        }
        None if wide || by_turning >= 0.9 * by_chain => {
            (MultiViewKind::Rotations, turned.contradicting, Solved::Scene(Box::new(turned.scene)), None)
        }
        None => {
            let roughly = (by_turning >= ROUGHLY * by_chain).then_some(turned.scene);
            // Homographies are chained through all of them.
            (MultiViewKind::Homographies, Vec::new(), Solved::Chain { chain, links: links.to_vec() }, roughly)
        }
    };
    let turned = turned.map(Box::new);
    MultiView { kind, contradicting, given: false, lenses: lenses.to_vec(), prior, solved, turned }
}

/// The share of all matches that homographies explain.
fn explained_by_chain(chain: &Chain, lenses: &[Lens], links: &[PairLink]) -> f64 {
    let (mut all, mut explained) = (0usize, 0usize);
    for link in links {
        all += link.matches.len();
        let Some(h) = chain.between(link.photos) else { continue };
        for [from, to] in link.centred_matches(lenses) {
            let p = h * nalgebra::Vector3::new(from[0], from[1], 1.0);
            let (dx, dy) = (p[0] / p[2] - to[0], p[1] / p[2] - to[1]);
            explained += usize::from(p[2] > 0.0 && dx * dx + dy * dy < EXPLAINED * EXPLAINED);
        }
    }
    explained as f64 / all.max(1) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::geometry::{Match, Model, ModelKind};

    /// What is found of two photos, between which the camera moved and turned, if so many of 120 points are near.
    fn found(near: usize) -> (Lens, PairLink) {
        let lens = Lens { size: (800, 600), focal: Some(700.0) };
        let [k, back] = lens.calibration(0.7);
        let rotation = *Rotation3::from_euler_angles(0.0, 0.25, 0.0).matrix();
        let motion = Vector3::new(-0.4, 0.05, -0.6);
        let matches = (0..120).filter_map(|i| {
            let target = [(i * 97 % 500) as f64 + 20.0, (i * 61 % 560) as f64 + 20.0];
            let depth = if i < near { 0.1 + (i % 7) as f64 * 0.05 } else { 0.0 };
            let ray = back * Vector3::new(target[0], target[1], 1.0);
            let p = k * (rotation * ray + motion * depth);
            (p[2] > 0.0).then(|| Match { target, reference: [p[0] / p[2], p[1] / p[2]] })
        });
        let matches: Vec<Match> = matches.collect();
        let features = (0..matches.len()).map(|i| [i as u32; 2]).collect();
        let model = Model { h: k * (rotation * back), e: k * motion };
        let link = PairLink { photos: [0, 1], features, matches, model, kind: ModelKind::TwoView };
        (lens, link)
    }

    fn geometry_of(near: usize) -> MultiView {
        let (lens, link) = found(near);
        multi_view(&[lens; 2], &[link], None, false)
    }

    #[test]
    fn the_reference_has_a_place_though_it_shares_no_landmark() {
        let (lens, link) = found(80);
        // A pair of whatever: nothing that a third photo sees says where it was.
        let place = |i: usize| [(i * 89 % 700) as f64, (i * 53 % 500) as f64];
        let matches: Vec<Match> = (0..30).map(|i| Match { target: place(i), reference: place(i + 7) }).collect();
        let features = (0..30).map(|i| [500 + i, i]).collect();
        let model = Model::homography(nalgebra::Matrix3::identity());
        let weak = PairLink { photos: [1, 2], features, matches, model, kind: ModelKind::Homography };
        let links = [link, weak];
        let free = multi_view(&[lens; 3], &links, None, false);
        assert!(free.kind == MultiViewKind::Cameras && !free.is_placed(2));
        assert!(multi_view(&[lens; 3], &links, Some(2), false).is_placed(2));
    }

    #[test]
    fn cameras_that_turned_take_the_place_of_others_where_most_is_far() {
        let mut geometry = geometry_of(20);
        assert_eq!(geometry.kind, MultiViewKind::Cameras);
        assert!(!geometry.samples(0, 1).is_empty());
        assert!(geometry.ignore_parallax());
        assert_eq!(geometry.kind, MultiViewKind::Rotations);
        assert_eq!(geometry.model([0, 1]).unwrap().e, Vector3::zeros());
        assert!(geometry.samples(0, 1).is_empty());
        assert!(!geometry.ignore_parallax());
        assert!(!geometry_of(80).ignore_parallax());
    }
}
