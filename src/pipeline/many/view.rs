//! In whose view the photos are shown, which of them can be, and in which order.

use crate::geometry::{Model, MultiView, PairLink};
use crate::rect::diagonal;
use crate::statistics::median;

/// A photo that would be enlarged by more than this, in area and at the median, is left out.
const MOST_STRETCH: f64 = 4.0;
/// So is one that looks farther to the side than the angle of this cosine, 60°: on a plane it would have no end.
const LEAST_COSINE: f64 = 0.5;
/// Points a row and a column that are looked at.
const POINTS: usize = 9;

/// Width and height in pixels.
type Size = (usize, usize);

/// The photo in whose view most of the others can be shown; of several the one from which they are the least far away: the
/// largest distance of their middles from its own is the smallest.
pub(super) fn middle(sizes: &[Size], candidates: &[usize], geometry: &MultiView) -> usize {
    let mut best: Option<(usize, f64, usize)> = None;
    for &photo in candidates {
        let (mut shown, mut farthest) = (0, 0.0f64);
        for &other in candidates.iter().filter(|other| **other != photo) {
            if can_be_shown(sizes, [other, photo], geometry) {
                shown += 1;
                let there = distance(sizes, [other, photo], geometry);
                farthest = farthest.max(there + distance(sizes, [photo, other], geometry));
            }
        }
        if best.is_none_or(|(most, least, _)| shown > most || shown == most && farthest < least) {
            best = Some((shown, farthest, photo));
        }
    }
    best.map_or(0, |(.., photo)| photo)
}

/// How far from the middle of a photo the middle of another appears, in diagonals; infinitely far behind the camera.
fn distance(sizes: &[Size], [from, to]: [usize; 2], geometry: &MultiView) -> f64 {
    let Some(model) = geometry.model([from, to]) else { return f64::INFINITY };
    let middle = |(w, h): Size| [0.5 * (w as f64 - 1.0), 0.5 * (h as f64 - 1.0)];
    let ([x, y], [cx, cy]) = (middle(sizes[from]), middle(sizes[to]));
    let Some([u, v]) = model.project(x, y, typical_depth(geometry, [from, to])) else { return f64::INFINITY };
    ((u - cx) * (u - cx) + (v - cy) * (v - cy)).sqrt() / diagonal(sizes[to])
}

/// The median inverse depth of a photo's landmarks; 0 without parallax.
fn typical_depth(geometry: &MultiView, [photo, other]: [usize; 2]) -> f64 {
    median(geometry.samples(photo, other).iter().map(|s| s.depth).collect()).unwrap_or(0.0)
}

/// Whether a photo can be shown in the reference's view: it is neither stretched beyond recognition nor far to the side.
pub(super) fn can_be_shown(sizes: &[Size], [photo, reference]: [usize; 2], geometry: &MultiView) -> bool {
    if let (Some(own), Some(other)) = (geometry.camera(photo), geometry.camera(reference)) {
        // Between the optical axes.
        let cosine = (other.rotation * own.rotation.transpose())[(2, 2)];
        if cosine < LEAST_COSINE {
            return false;
        }
    }
    let Some(model) = geometry.model([photo, reference]) else { return false };
    // A longer lens is no stretch.
    let zoom = match (geometry.focal(reference), geometry.focal(photo)) {
        (Some(of_reference), Some(own)) => of_reference / own,
        _ => 1.0,
    };
    let depth = typical_depth(geometry, [photo, reference]);
    stretch(&model, sizes[photo], depth).is_some_and(|stretch| stretch < MOST_STRETCH * zoom * zoom)
}

/// By how much a photo's area grows, at the median; `None` where most of it is behind the camera or turned over.
fn stretch(model: &Model, (w, h): Size, depth: f64) -> Option<f64> {
    let mut areas = Vec::new();
    for j in 0..POINTS {
        for i in 0..POINTS {
            let at = |k: usize, side: usize| (k as f64 + 0.5) / POINTS as f64 * (side as f64 - 2.0);
            let (x, y) = (at(i, w), at(j, h));
            let place = |x, y| model.project(x, y, depth);
            let area = match (place(x, y), place(x + 1.0, y), place(x, y + 1.0)) {
                (Some(a), Some(b), Some(c)) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]),
                _ => -1.0,
            };
            areas.push(if area > 0.0 { area } else { f64::INFINITY });
        }
    }
    median(areas).filter(|area| area.is_finite())
}

/// The photos from the reference outward: each time the one with most matches with those before; first the reference.
pub(super) fn outward(reference: usize, photos: &[usize], links: &[PairLink]) -> Vec<usize> {
    let mut order = vec![reference];
    while order.len() < photos.len() {
        let shared = |photo: usize| -> usize {
            let ties = |link: &&PairLink| {
                let [a, b] = link.photos;
                a == photo && order.contains(&b) || b == photo && order.contains(&a)
            };
            links.iter().filter(ties).map(|link| link.matches.len()).sum()
        };
        let rest = photos.iter().copied().filter(|photo| !order.contains(photo));
        let Some(next) = rest.max_by_key(|&photo| (shared(photo), usize::MAX - photo)) else { break };
        order.push(next);
    }
    order
}
