//! Which matches can be used at all.

use super::{Frame, Match};
use std::collections::BTreeSet;

/// A match that can be used, with the inverse depth at both ends (NaN at a hole or without a map).
#[derive(Debug, Clone, Copy)]
pub(super) struct Usable {
    /// Its place among the matches passed.
    pub index: usize,
    pub target: [f64; 2],
    pub reference: [f64; 2],
    pub target_depth: f64,
    pub reference_depth: f64,
}

impl Usable {
    /// Depth known at both ends.
    pub fn has_depth(&self) -> bool {
        (self.target_depth + self.reference_depth).is_finite()
    }
}

/// Drops the matches that are not finite or lie outside a frame (a pixel reaches half a pixel around its centre), and
/// all but the first of those that share a point on either side: repeated matches would outvote the others.
pub(super) fn clean(matches: &[Match], target: &Frame<'_>, reference: &Frame<'_>) -> Vec<Usable> {
    let mut usable: Vec<Usable> = matches
        .iter()
        .enumerate()
        .filter(|(_, m)| target.contains(m.target) && reference.contains(m.reference))
        .map(|(index, m)| Usable {
            index,
            target: m.target,
            reference: m.reference,
            target_depth: target.depth_at(m.target),
            reference_depth: reference.depth_at(m.reference),
        })
        .collect();
    for side in [|m: &Usable| m.target, |m: &Usable| m.reference] {
        let mut seen = BTreeSet::new();
        // Adding 0 makes −0 and 0 the same place.
        usable.retain(|m| seen.insert(side(m).map(|v| (v + 0.0).to_bits())));
    }
    usable
}

impl Frame<'_> {
    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let inside = |v: f64, size: usize| v >= -0.5 && v <= size as f64 - 0.5;
        inside(x, self.size.0) && inside(y, self.size.1)
    }

    fn depth_at(&self, [x, y]: [f64; 2]) -> f64 {
        self.depth.map_or(f64::NAN, |d| d.sample(x, y))
    }
}

/// The smaller and the larger standard deviation of points along their principal axes, in pixels.
pub(super) fn spread(points: impl Iterator<Item = [f64; 2]> + Clone) -> [f64; 2] {
    let n = points.clone().count().max(1) as f64;
    let [cx, cy] = points.clone().fold([0.0, 0.0], |[a, b], [x, y]| [a + x, b + y]).map(|s| s / n);
    let [xx, xy, yy] = points
        .fold([0.0; 3], |[a, b, c], [x, y]| [a + (x - cx) * (x - cx), b + (x - cx) * (y - cy), c + (y - cy) * (y - cy)])
        .map(|s| s / n);
    let half = (xx + yy) / 2.0;
    let radius = ((xx - yy) * (xx - yy) / 4.0 + xy * xy).sqrt();
    [(half - radius).max(0.0).sqrt(), (half + radius).sqrt()]
}
