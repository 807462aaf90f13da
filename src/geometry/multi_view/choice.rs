//! Which geometry explains all photos: cameras with parallax, cameras that turned, or homographies.

use super::bundle::FreeParameters;
use super::growth::{LANDMARKS, around, finish, grow};
use super::homographies::Chain;
use super::lens::{COUNT_RATIO, with_distortion};
use super::lens_ratios::calibrate_each;
use super::loops::{Rotations, close_loops};
use super::relative_pose::{relative_pose, turn};
use super::resection::TOLERANCE;
use super::rotations::{are_wide, average};
use super::scene::{Camera, Scene};
use super::self_calibration::{Focal, calibrate};
use super::solution::{MultiView, MultiViewKind, Solved};
use super::tracks::{Track, select_tracks, tracks};
use super::{Lens, PairLink};
use crate::geometry::Distortion;

/// A match counts as explained up to this error, as a share of the diagonal: 2.5 pixels of 1300.
const EXPLAINED: f64 = 0.0019;
/// Cameras that only turned and explain this share of what homographies do may say what to show photos on: those of photos that did turn
/// explain 0.83 and more on the real sets, those of flat scenes 0.41 and less.
const ROUGHLY: f64 = 0.7;
/// Focal lengths of the photos' own explain them better than a common one at this share of its cost.
const CLEARLY: f64 = 0.8;

/// What cameras are found from.
struct Pairs<'a> {
    lenses: &'a [Lens],
    links: &'a [PairLink],
    root: usize,
    may_distort: bool,
}

/// Cameras that explain the photos.
struct Candidate {
    scene: Scene,
    /// Pairs that take no part, by their index.
    contradicting: Vec<usize>,
    /// How many observations of each track beyond its first are explained, and how many there are.
    explained: usize,
    all: usize,
}

/// Finds the geometry of photos that `links` connect with `root`, which always has a place; and the lens' distortion,
/// if it `may_distort`.
pub fn multi_view(lenses: &[Lens], links: &[PairLink], root: usize, may_distort: bool) -> MultiView {
    let pairs = Pairs { lenses, links, root, may_distort };
    let focal = calibrate(lenses, links);
    let prior = focal.prior;
    let own = calibrate_each(lenses, links, &focal);
    let (mut grown, mut turned) = pairs.candidates(focal);
    if let Some(focal) = own {
        let own = pairs.candidates(focal);
        grown = own.0.filter(|own| grown.as_ref().is_none_or(|common| own.is_better(common))).or(grown);
        turned = if own.1.is_better(&turned) { own.1 } else { turned };
    }
    let chain = Chain::of(lenses, links, &turned.scene.diagonals, root);
    let (kind, contradicting, solved) = choose(lenses, links, grown, turned, chain);
    MultiView { kind, contradicting, given: false, lenses: lenses.to_vec(), prior, solved }
}

impl Pairs<'_> {
    /// With these focal lengths: cameras in different places, if there are any, and cameras that only turned.
    fn candidates(&self, focal: Focal) -> (Option<Candidate>, Candidate) {
        let (lenses, links, root) = (self.lenses, self.links, self.root);
        let poses = links.iter().map(|link| relative_pose(link, lenses, focal.of(link.photos)));
        let posed = Rotations::of(poses.collect(), lenses.len(), root);
        let mut grown = self.grown(&focal, &posed);
        let closed = close_loops(lenses, links, &focal, posed.contradicting.len(), root);
        let (focal, turns) = closed.unwrap_or((focal, posed));
        let turned = self.turned(&focal, &turns.contradicting);
        let more = |other: &Candidate| {
            let more = |grown: &Candidate| COUNT_RATIO * other.explained as f64 > grown.explained as f64;
            grown.as_ref().is_none_or(more)
        };
        if turned.is_wide()
            && let Some(around) = Some(self.around(&turned, focal.prior)).filter(more)
        {
            grown = Some(around);
        }
        (grown, turned)
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
        // For a comparison, and where it is chosen it has few unknowns.
        finish(
            &mut scene,
            &select_tracks(&tracks, lenses.len(), LANDMARKS),
            self.root,
            FreeParameters::ROTATIONS,
            focal.prior,
        );
        scene.triangulate(&tracks, TOLERANCE);
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
        self.candidate(scene, &tracks, &turned.contradicting, FreeParameters::POSES, prior)
    }

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
        let close = |photo: usize, distance: f64| distance < EXPLAINED * scene.diagonals[photo];
        let seen = scene.landmarks.iter().flat_map(|landmark| landmark.seen.iter().map(move |o| (landmark, o)));
        let explained = seen.filter(|(landmark, o)| close(o.photo, scene.distance(landmark, o))).count();
        let all = tracks.iter().map(|track| track.len() - 1).sum();
        Candidate { scene, contradicting: contradicting.to_vec(), explained, all }
    }
}

impl Candidate {
    /// Whether it explains the photos clearly better than another does.
    fn is_better(&self, other: &Self) -> bool {
        let all = self.all.max(other.all);
        self.cost(all) < CLEARLY * other.cost(all)
    }

    /// The mean square error of `all` observations, where those that are not explained have the most that explained ones may have.
    fn cost(&self, all: usize) -> f64 {
        let noise = self.scene.residual_noise().unwrap_or(0.0);
        let most = EXPLAINED * self.scene.diagonals.iter().sum::<f64>() / self.scene.diagonals.len() as f64;
        let share = self.explained as f64 / all.max(1) as f64;
        share * noise * noise + (1.0 - share) * most * most
    }

    fn is_wide(&self) -> bool {
        let rotations = self.scene.cameras.iter().map(|camera| camera.map(|camera| camera.rotation));
        are_wide(&rotations.collect::<Vec<_>>())
    }
}

fn choose(
    lenses: &[Lens],
    links: &[PairLink],
    grown: Option<Candidate>,
    turned: Candidate,
    chain: Chain,
) -> (MultiViewKind, Vec<usize>, Solved) {
    let all = grown.as_ref().map_or(0, |grown| grown.all).max(turned.all).max(1);
    let share = |candidate: &Candidate| candidate.explained as f64 / all as f64;
    let (by_turning, by_chain) = (share(&turned), explained_by_chain(&chain, lenses, links));
    // Homographies show only what is before all cameras.
    let wide = turned.is_wide() && by_turning >= ROUGHLY * by_chain;
    // To different places and depth the distortion of a lens in one place looks like parallax.
    let distorted = turned.scene.distortion != Distortion::default();
    let least = if wide { by_turning } else { by_chain };
    let chosen = |grown: &Candidate| share(grown) > least && !(distorted && by_turning >= COUNT_RATIO * share(grown));
    match grown.filter(chosen) {
        Some(Candidate { scene, contradicting, .. }) => {
            (MultiViewKind::Cameras, contradicting, Solved::Scene(Box::new(scene)))
        }
        None if wide || by_turning >= 0.9 * by_chain => {
            (MultiViewKind::Rotations, turned.contradicting, Solved::Scene(Box::new(turned.scene)))
        }
        None => {
            let roughly = (by_turning >= ROUGHLY * by_chain).then(|| Box::new(turned.scene));
            let solved = Solved::Chain { chain, links: links.to_vec(), turned: roughly };
            // Homographies are chained through all of them.
            (MultiViewKind::Homographies, Vec::new(), solved)
        }
    }
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
