//! How far a way of showing what only the target shows puts it from where it most probably is.

use crate::depth::Surface;
use crate::geometry::Model;
use crate::rect::diagonal;

/// The target is looked at at so many points a side. Flat between 16 and 64.
const POINTS: usize = 32;
/// The most a point counts, as a share of the reference's diagonal: beyond it is wrong all the same.
const MOST: f64 = 0.15;

/// Points that only the target shows, and where they would land by the surface expected of them.
pub(super) struct Expected {
    points: Vec<[[f64; 2]; 2]>,
    diagonal: f64,
}

impl Expected {
    /// By the target's expected inverse depth; `model` leads from it to the reference. Sizes are those of target and reference.
    pub fn new(surface: &Surface, model: &Model, [(w, h), reference]: [(usize, usize); 2]) -> Self {
        let at = |i: usize, side: usize| i as f64 / (POINTS - 1) as f64 * (side - 1) as f64;
        let points = (0..POINTS * POINTS).map(|i| [at(i % POINTS, w), at(i / POINTS, h)]);
        let inside = |p: f64, side: usize| p >= 0.0 && p < side as f64;
        let landing = |point: [f64; 2]| {
            let place = model.project(point[0], point[1], surface.at(point))?;
            let seen = inside(place[0], reference.0) && inside(place[1], reference.1);
            (!seen).then_some([point, place])
        };
        Self { points: points.filter_map(landing).collect(), diagonal: diagonal(reference) }
    }

    /// Those points of the target.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.points.iter().map(|[point, _]| *point)
    }

    /// The mean distance from there of where the points land by `place`, as a share of the reference's diagonal.
    pub fn displacement(&self, place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>) -> f64 {
        let off = |[point, expected]: &[[f64; 2]; 2]| {
            let Some([u, v]) = place(*point) else { return MOST };
            let (x, y) = (u - expected[0], v - expected[1]);
            ((x * x + y * y).sqrt() / self.diagonal).min(MOST)
        };
        self.points.iter().map(off).sum::<f64>() / self.points.len().max(1) as f64
    }
}
