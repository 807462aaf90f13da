//! The plane of relative inverse depth that most of the points are close to.

use nalgebra::{Matrix3, Vector3};

use super::model::Model;
use crate::statistics::median;

/// Iterations of reweighted least squares; the plane hardly changes after ten.
const ITERATIONS: usize = 20;
/// Points whose normal equations have a pivot below this share of its diagonal entry lie on one line.
const MIN_PIVOT: f64 = 1e-10;

/// A point of one photo with its inverse depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthSample {
    /// x, y in pixels.
    pub point: [f64; 2],
    /// Inverse depth there.
    pub depth: f64,
    /// By how many pixels its image in the other photo moves per unit of inverse depth.
    pub parallax: f64,
}

impl DepthSample {
    /// A point of the photo that `model` takes to the other.
    pub(crate) fn new(model: &Model, point: [f64; 2], depth: f64) -> Self {
        Self { point, depth, parallax: model.parallax(point, depth) }
    }

    /// Distance in pixels of the other photo from where a plane's inverse depth would put this.
    pub(crate) fn distance(&self, plane: [f64; 3]) -> f64 {
        (self.depth - plane_depth(plane, self.point)).abs() * self.parallax
    }
}

/// a, b, c of depth = ax + by + c with the least sum of distances in the other photo, by iteratively reweighted least
/// squares; errors up to `unit` have the weight of `unit`. `None` if the points lie on one line.
pub(crate) fn dominant_plane(points: &[DepthSample], unit: f64) -> Option<[f64; 3]> {
    let mut plane = [0.0, 0.0, median(points.iter().map(|m| m.depth).collect())?];
    for _ in 0..ITERATIONS {
        plane = weighted_plane(points.iter().map(|m| (m, m.parallax * m.parallax / m.distance(plane).max(unit))))?;
    }
    Some(plane)
}

/// The dominant planes of the parts of a photo of this size, divided into so many `tiles` a side, each number in turn; none of a tile with
/// fewer points than `fewest`.
pub(crate) fn tile_planes(
    points: &[DepthSample],
    (w, h): (usize, usize),
    tiles: &[usize],
    fewest: usize,
) -> impl Iterator<Item = [f64; 3]> {
    let all = tiles.iter().flat_map(|&count| (0..count * count).map(move |tile| (count, tile)));
    all.filter_map(move |(count, tile)| {
        let at = |p: f64, side: usize| ((p * count as f64 / side as f64) as usize).min(count - 1);
        let within = |s: &&DepthSample| at(s.point[0], w) + count * at(s.point[1], h) == tile;
        let part: Vec<DepthSample> = points.iter().filter(within).copied().collect();
        if part.len() < fewest { None } else { dominant_plane(&part, 1.0) }
    })
}

/// a, b, c of depth = ax + by + c with the least weighted sum of squared differences of depth. `None` if the points lie on one
/// line.
pub(crate) fn weighted_plane<'a>(points: impl Iterator<Item = (&'a DepthSample, f64)>) -> Option<[f64; 3]> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (m, weight) in points {
        let p = Vector3::new(m.point[0], m.point[1], 1.0);
        normal.syger(weight, &p, &p, 1.0);
        right += p * (weight * m.depth);
    }
    let factor = normal.cholesky()?;
    let pivot = |i: usize| factor.l_dirty()[(i, i)];
    (0..3).all(|i| pivot(i) * pivot(i) > MIN_PIVOT * normal[(i, i)]).then(|| factor.solve(&right).into())
}

/// The plane's inverse depth at a point.
pub(crate) fn plane_depth([a, b, c]: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    a * x + b * y + c
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    fn samples(points: impl Iterator<Item = [f64; 2]>) -> Vec<DepthSample> {
        points
            .map(|point| DepthSample { point, depth: plane_depth([1e-4, -2e-4, 0.5], point), parallax: 100.0 })
            .collect()
    }

    #[test]
    fn a_small_spot_far_away_has_its_plane() {
        let spot = samples((0..30).map(|i| [5900.0 + f64::from(i % 6), 3900.0 + f64::from(i / 6)]));
        let plane = dominant_plane(&spot, 1.0).unwrap();
        for [x, y] in [[5900.0, 3900.0], [5800.0, 3950.0]] {
            assert!((plane_depth(plane, [x, y]) - plane_depth([1e-4, -2e-4, 0.5], [x, y])).abs() < 1e-4, "{plane:?}");
        }
    }

    #[test]
    fn points_on_a_line_have_none() {
        for slope in (0..200).map(|i| 0.013 * f64::from(i) - 1.3) {
            for count in [1, 2, 12] {
                let line = samples((0..count).map(|i| 17.3 * f64::from(i)).map(|x| [x, slope * x + 284.5]));
                assert_eq!(dominant_plane(&line, 1.0), None, "{count} points, slope {slope}");
            }
        }
    }
}
