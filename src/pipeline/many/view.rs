//! In whose view the photos are shown, which of them can be, and in which order.

use std::cmp::Ordering;

use nalgebra::Vector3;

use super::picture::{ManyPicture, typical_depth};
use crate::geometry::{DepthSample, MultiView, PairLink};
use crate::pipeline::picture::Size;
use crate::rect::diagonal;
use crate::statistics::nth;

/// A photo that would be enlarged by more than this, in area and at the median, is left out.
const MOST_STRETCH: f64 = 4.0;
/// So is one that looks more than 60° to the side on a plane, where it would have no end: the cosine.
const WIDEST: f64 = 0.5;

/// The photo from which the others are the least far away: the largest distance of their middles from its own and the logarithm of the largest
/// [`enlargement`], in area, make up the least. For a `plane` it is one in whose view most of the others can be shown. Of photos taken
/// on the way forward it is an early one, as all that is beside the way is drawn out and blurred in the later ones' views.
pub(super) fn middle(sizes: &[Size], candidates: &[usize], geometry: &MultiView, plane: bool) -> usize {
    let mut best: Option<((usize, f64), usize)> = None;
    for &photo in candidates {
        let (mut shown, mut farthest, mut enlarged) = (0, 0.0f64, 1.0f64);
        for &other in candidates.iter().filter(|other| **other != photo) {
            if !plane || can_be_shown(&ManyPicture::plane(photo), other, sizes, geometry) {
                shown += 1;
                enlarged = enlarged.max(enlargement([other, photo], geometry));
                let there = distance(sizes, [other, photo], geometry);
                farthest = farthest.max(there + distance(sizes, [photo, other], geometry));
            }
        }
        let found = (shown, -(farthest + 2.0 * libm::log(enlarged)));
        if best.is_none_or(|(most, _)| found.partial_cmp(&most).is_some_and(Ordering::is_gt)) {
            best = Some((found, photo));
        }
    }
    best.map_or(0, |(_, photo)| photo)
}

/// How many times larger the nearer landmarks of a photo appear in the view of another, which was taken closer to them; 1 where that is
/// not known.
fn enlargement([from, to]: [usize; 2], geometry: &MultiView) -> f64 {
    let (Some(model), Some([_, own]), Some([_, other])) =
        (geometry.model([from, to]), geometry.calibration(from), geometry.calibration(to))
    else {
        return 1.0;
    };
    let ratio = |sample: &DepthSample| {
        let [x, y] = sample.point;
        let there = other * Vector3::from(model.transform(x, y, sample.depth));
        (own * Vector3::new(x, y, 1.0)).norm() / there.norm()
    };
    let ratios: Vec<f64> = geometry.samples(from, to).iter().map(ratio).collect();
    let nearer = ratios.len() * 3 / 4;
    nth(ratios, nearer).unwrap_or(1.0)
}

/// How far from the middle of a photo the middle of another appears: the angle, or without cameras in diagonals, infinitely far
/// behind.
fn distance(sizes: &[Size], [from, to]: [usize; 2], geometry: &MultiView) -> f64 {
    let Some(model) = geometry.model([from, to]) else { return f64::INFINITY };
    let middle = |(w, h): Size| [0.5 * (w as f64 - 1.0), 0.5 * (h as f64 - 1.0)];
    let ([x, y], [cx, cy]) = (middle(sizes[from]), middle(sizes[to]));
    let depth = typical_depth(geometry, [from, to]);
    if let Some([_, to_rays]) = geometry.calibration(to) {
        let ray = to_rays * Vector3::from(model.transform(x, y, depth));
        return libm::atan2((ray[0] * ray[0] + ray[1] * ray[1]).sqrt(), ray[2]);
    }
    let Some([u, v]) = model.project(x, y, depth) else { return f64::INFINITY };
    ((u - cx) * (u - cx) + (v - cy) * (v - cy)).sqrt() / diagonal(sizes[to])
}

/// Whether a photo can be shown in the picture: it is neither stretched beyond recognition nor, on a plane, far to the side.
pub(super) fn can_be_shown(picture: &ManyPicture, photo: usize, sizes: &[Size], geometry: &MultiView) -> bool {
    if picture.is_plane()
        && let (Some(own), Some(other)) = (geometry.camera(photo), geometry.camera(picture.reference))
    {
        // Between the optical axes.
        let cosine = other.rotation.row(2).dot(&own.rotation.row(2));
        if cosine < WIDEST {
            return false;
        }
    }
    picture.stretch(photo, sizes, geometry).is_some_and(|stretch| stretch < MOST_STRETCH)
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
