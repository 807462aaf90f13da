//! The matches that can be used at all.

use nalgebra::{Matrix2, Vector2};

use super::{Frame, Match};
use crate::sort::sort_indices;

/// A match that can be used.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Usable {
    /// Its index among the matches passed.
    pub index: usize,
    /// The points of the target and the reference.
    pub ends: [[f64; 2]; 2],
    /// The inverse depth at both, NaN at a hole or without a map.
    pub depths: [f64; 2],
}

impl Usable {
    /// Depth known at both ends.
    pub fn has_depth(&self) -> bool {
        (self.depths[0] + self.depths[1]).is_finite()
    }
}

/// The items whose flag is set.
pub(super) fn flagged<T: Copy>(items: &[T], flags: &[bool]) -> Vec<T> {
    items.iter().zip(flags).filter(|(_, flag)| **flag).map(|(item, _)| *item).collect()
}

/// Drops the matches that are not finite or lie outside a frame (a pixel extends half a pixel around its centre), and
/// all but the first of those that share a point on either side: repeated matches would outvote the others.
pub(crate) fn usable_matches(matches: &[Match], frames: [&Frame<'_>; 2]) -> Vec<Usable> {
    let mut usable = Vec::new();
    for (index, m) in matches.iter().enumerate() {
        let ends = [m.target, m.reference];
        if (0..2).all(|side| frames[side].contains(ends[side])) {
            usable.push(Usable { index, ends, depths: [0, 1].map(|side| frames[side].depth_at(ends[side])) });
        }
    }
    for side in 0..2 {
        // Adding 0 turns −0 into 0.
        let place = |i: u32| usable[i as usize].ends[side].map(|v| (v + 0.0).to_bits());
        let mut order: Vec<u32> = (0..usable.len() as u32).collect();
        sort_indices(&mut order, &|a, b| (place(a), a).cmp(&(place(b), b)));
        let mut first = vec![true; usable.len()];
        for pair in order.windows(2) {
            first[pair[1] as usize] = place(pair[0]) != place(pair[1]);
        }
        usable = flagged(&usable, &first);
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

/// The smaller and the larger standard deviation of the matches' points in one photo (0 the target, 1 the reference) along
/// their principal axes, in pixels.
pub(super) fn standard_deviations(matches: &[Usable], side: usize) -> [f64; 2] {
    let n = matches.len().max(1) as f64;
    let points = || matches.iter().map(|m| Vector2::from(m.ends[side]));
    let mean = points().sum::<Vector2<f64>>() / n;
    let covariance = points().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix2<f64>>() / n;
    let [xx, xy, yy] = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]];
    let half = (xx + yy) / 2.0;
    let radius = ((xx - yy) * (xx - yy) / 4.0 + xy * xy).sqrt();
    [(half - radius).max(0.0).sqrt(), (half + radius).sqrt()]
}

/// The area over which outliers are spread, in square pixels of the reference: a rectangle of the same covariance as the
/// matches, as outliers are no wider spread than the features are.
pub(super) fn scatter_area(matches: &[Usable]) -> f64 {
    let [narrow, wide] = standard_deviations(matches, 1);
    12.0 * narrow * wide
}
