//! Tracks: one scene point as several photos see it.

use super::{Lens, PairLink};

/// A feature of a photo, in centred coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Observation {
    pub photo: usize,
    pub place: [f64; 2],
}

/// The observations of one scene point, one per photo, in the order of the photos.
pub(super) type Track = Vec<Observation>;

/// How many observations tracks have beyond their first.
pub(super) fn count_observations(tracks: &[Track]) -> usize {
    tracks.iter().map(|track| track.len() - 1).sum()
}

/// A set of a forest of disjoint sets, by its root.
fn root(parents: &mut [u32], mut at: u32) -> u32 {
    while parents[at as usize] != at {
        let above = parents[parents[at as usize] as usize];
        parents[at as usize] = above;
        at = above;
    }
    at
}

/// The tracks that the matches of all pairs form. Where a track has two features of one photo, one of them is wrong: that
/// photo's are left out.
pub(super) fn tracks(lenses: &[Lens], links: &[PairLink]) -> Vec<Track> {
    // Features of all photos, numbered one after the other.
    let mut counts = vec![0u32; lenses.len()];
    for link in links {
        for features in &link.features {
            for (photo, feature) in link.photos.iter().zip(features) {
                counts[*photo] = counts[*photo].max(feature + 1);
            }
        }
    }
    let mut first = vec![0u32; lenses.len() + 1];
    for (photo, count) in counts.iter().enumerate() {
        first[photo + 1] = first[photo] + count;
    }
    let total = first[lenses.len()];
    let mut parents: Vec<u32> = (0..total).collect();
    let mut seen: Vec<Option<Observation>> = vec![None; total as usize];
    for link in links {
        for (features, m) in link.features.iter().zip(&link.matches) {
            let ends = [0, 1].map(|side| first[link.photos[side]] + features[side]);
            for ((photo, place), at) in link.photos.iter().zip([m.target, m.reference]).zip(ends) {
                seen[at as usize] = Some(Observation { photo: *photo, place: lenses[*photo].centred(place) });
            }
            let [a, b] = ends.map(|at| root(&mut parents, at));
            // The smaller is the root, so that the order of the tracks is that of the features.
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers: Vec<u32> = vec![u32::MAX; total as usize];
    let mut tracks: Vec<Track> = Vec::new();
    for at in 0..total {
        let Some(observation) = seen[at as usize] else { continue };
        let number = &mut numbers[root(&mut parents, at) as usize];
        if *number == u32::MAX {
            *number = tracks.len() as u32;
            tracks.push(Vec::new());
        }
        tracks[*number as usize].push(observation);
    }
    for track in &mut tracks {
        let all = track.clone();
        track.retain(|o| all.iter().filter(|other| other.photo == o.photo).count() == 1);
    }
    tracks.retain(|track| track.len() >= 2);
    tracks
}

/// So few photos are no work.
const FEW_PHOTOS: usize = 8;

/// Of many photos enough of the tracks for each to have `count` of them, as far as there are so many, in their order. The longest are
/// preferred: they tie most photos together. All of few photos.
pub(super) fn select_tracks(tracks: &[Track], photos: usize, count: usize) -> Vec<Track> {
    let mut present = vec![false; photos];
    tracks.iter().flatten().for_each(|o| present[o.photo] = true);
    if present.iter().filter(|present| **present).count() <= FEW_PHOTOS {
        return tracks.to_vec();
    }
    let mut counts = vec![0; photos];
    let mut order: Vec<usize> = (0..tracks.len()).collect();
    order.sort_unstable_by_key(|&i| (std::cmp::Reverse(tracks[i].len()), i));
    order.retain(|&i| {
        let wanted = tracks[i].iter().any(|o| counts[o.photo] < count);
        if wanted {
            tracks[i].iter().for_each(|o| counts[o.photo] += 1);
        }
        wanted
    });
    order.sort_unstable();
    order.into_iter().map(|i| tracks[i].clone()).collect()
}
