//! What a wide view is projected onto: a cylinder or a sphere around the viewer, unrolled.

use nalgebra::Vector3;

use super::canvas::Limits;
use crate::geometry::Model;

/// How directions become places in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// As a camera does. Straight lines stay straight, and what is far from the middle is stretched.
    Plane,
    /// Equal angles to the left and right are equally wide. Upright lines stay straight.
    Cylinder,
    /// The same up and down.
    Sphere,
}

/// Farthest to the left and right, in radians: a picture ends before it meets itself.
const WIDEST: f64 = 0.98 * std::f64::consts::PI;
/// Farthest up and down on a cylinder, in radii.
const HIGHEST: f64 = 2.5;

/// A cylinder with an upright axis or a sphere. Rays are (x, y, z): to the right, down and ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Screen {
    pub sphere: bool,
    /// Pixels per radian.
    pub focal: f64,
    /// Where the ray (0, 0, 1) appears, in pixels.
    pub centre: [f64; 2],
}

impl Screen {
    /// Where a ray of any length appears, in pixels; NaN of the ray (0, 0, 0).
    pub fn project(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let across = (x * x + z * z).sqrt();
        let down = if self.sphere { libm::atan2(y, across) } else { y / across };
        [self.centre[0] + self.focal * libm::atan2(x, z), self.centre[1] + self.focal * down]
    }

    /// The ray that appears at a place: on the sphere, or on the cylinder, of radius 1.
    pub fn ray(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        let ([sin, cos], [down, across]) = (self.column(x), self.row(y));
        Vector3::new(sin * across, down, cos * across)
    }

    /// Sine and cosine of a column's direction.
    fn column(&self, x: f64) -> [f64; 2] {
        libm::sincos((x - self.centre[0]) / self.focal).into()
    }

    /// How far down a row's rays go, and how far from the axis.
    fn row(&self, y: f64) -> [f64; 2] {
        let down = (y - self.centre[1]) / self.focal;
        if self.sphere { libm::sincos(down).into() } else { [down, 1.0] }
    }

    /// The rays of all pixels of a picture of a size whose first one is at `first`.
    pub fn rays(&self, first: [f64; 2], (width, height): (usize, usize)) -> Rays {
        let single = |v: [f64; 2]| v.map(|v| v as f32);
        Rays {
            columns: (0..width).map(|i| single(self.column(first[0] + i as f64))).collect(),
            rows: (0..height).map(|i| single(self.row(first[1] + i as f64))).collect(),
        }
    }

    /// The farthest that something may appear.
    pub fn limits(&self) -> Limits {
        let high = if self.sphere { 0.5 * std::f64::consts::PI } else { HIGHEST };
        let at = |sign: f64| [self.centre[0] + sign * self.focal * WIDEST, self.centre[1] + sign * self.focal * high];
        Limits { min: at(-1.0), max: at(1.0) }
    }
}

/// Where a point with this depth appears on a `screen`, or on the plane; `None` behind the plane's camera.
pub(crate) fn project(screen: Option<&Screen>, model: &Model, [x, y]: [f64; 2], depth: f64) -> Option<[f64; 2]> {
    match screen {
        Some(screen) => Some(screen.project(model.transform(x, y, depth))),
        None => model.project(x, y, depth),
    }
}

/// The rays of a picture's pixels: each is (sin · across, down, cos · across).
pub(crate) struct Rays {
    columns: Vec<[f32; 2]>,
    rows: Vec<[f32; 2]>,
}

impl Rays {
    /// That of a pixel.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        let ([sin, cos], [down, across]) = (self.columns[x], self.rows[y]);
        [sin * across, down, cos * across]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_appear_where_they_come_from() {
        for sphere in [false, true] {
            let screen = Screen { sphere, focal: 500.0, centre: [320.0, 240.0] };
            for place in [[320.0, 240.0], [-900.0, 100.0], [1700.5, 500.25]] {
                let ray = screen.ray(place);
                let [x, y] = screen.project([3.0 * ray[0], 3.0 * ray[1], 3.0 * ray[2]]);
                assert!((x - place[0]).abs() < 1e-9 && (y - place[1]).abs() < 1e-9, "{x} {y} instead of {place:?}");
            }
            let rays = screen.rays([-900.0, 100.0], (3, 2));
            let (ray, [x, y, z]) = (screen.ray([-898.0, 101.0]), rays.at(2, 1));
            assert!([x, y, z].iter().zip(ray.iter()).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-6));
        }
    }
}
