//! What a wide view is projected onto: a cylinder or a sphere around the viewer, unrolled.

use nalgebra::Vector3;

use super::canvas::Limits;
use crate::geometry::Model;

/// How directions become places in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// As a camera does. Straight lines stay straight, and what is far from the middle is stretched.
    Plane,
    /// Equal angles to the left and right are equally wide. Upright lines stay straight. The axis is level instead where much more is up
    /// and down than to the sides: then equal angles up and down are equally high, and level lines stay straight.
    Cylinder,
    /// Equal angles to the left and right, up and down.
    Sphere,
}

/// Farthest around the axis, in radians: a picture ends before it meets itself.
const WIDEST: f64 = 0.98 * std::f64::consts::PI;
/// Farthest along the axis of a cylinder, in radii.
const HIGHEST: f64 = 2.5;

/// A cylinder or a sphere. Rays are (x, y, z): to the right, down and ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ProjectionSurface {
    pub sphere: bool,
    /// Whether the axis is level, from left to right, instead of upright: right and down change places.
    pub transverse: bool,
    /// Pixels per radian.
    pub focal: f64,
    /// Where the ray (0, 0, 1) appears, in pixels.
    pub centre: [f64; 2],
}

impl ProjectionSurface {
    /// Where a ray of any length appears, in pixels; NaN of the ray (0, 0, 0).
    pub fn project(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let [around, along] = self.axes([x, y]);
        let distance = (around * around + z * z).sqrt();
        let along = if self.sphere { libm::atan2(along, distance) } else { along / distance };
        let [x, y] = self.axes([libm::atan2(around, z), along]);
        [self.centre[0] + self.focal * x, self.centre[1] + self.focal * y]
    }

    /// From x and y to around and along the axis, and back.
    fn axes<T>(&self, [x, y]: [T; 2]) -> [T; 2] {
        if self.transverse { [y, x] } else { [x, y] }
    }

    /// The ray that appears at a place: on the sphere, or on the cylinder, of radius 1.
    pub fn ray(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        let [around, along] = self.axes([(x - self.centre[0]) / self.focal, (y - self.centre[1]) / self.focal]);
        let ([sin, cos], [along, distance]) = (self.around(around), self.along(along));
        let [x, y] = self.axes([sin * distance, along]);
        Vector3::new(x, y, cos * distance)
    }

    /// Sine and cosine of an angle around the axis.
    fn around(&self, angle: f64) -> [f64; 2] {
        libm::sincos(angle).into()
    }

    /// How far rays go along the axis, and how far from it.
    fn along(&self, place: f64) -> [f64; 2] {
        if self.sphere { libm::sincos(place).into() } else { [place, 1.0] }
    }

    /// The rays of all pixels of a picture of a size whose first one is at `first`.
    pub fn rays(&self, first: [f64; 2], (width, height): (usize, usize)) -> Rays {
        let of = |k: usize, side: usize, is_around: bool| {
            let place = move |i: usize| (first[k] + i as f64 - self.centre[k]) / self.focal;
            let ray = move |at: f64| if is_around { self.around(at) } else { self.along(at) };
            (0..side).map(|i| ray(place(i)).map(|v| v as f32)).collect()
        };
        Rays {
            transverse: self.transverse,
            columns: of(0, width, !self.transverse),
            rows: of(1, height, self.transverse),
        }
    }

    /// The farthest that something may appear.
    pub fn limits(&self) -> Limits {
        let far = self.axes([WIDEST, if self.sphere { 0.5 * std::f64::consts::PI } else { HIGHEST }]);
        let at = |sign: f64| [0, 1].map(|k| self.centre[k] + sign * self.focal * far[k]);
        Limits { min: at(-1.0), max: at(1.0) }
    }
}

/// Where a point with this depth appears on a `surface`, or on the plane; `None` behind the plane's camera.
pub(crate) fn project(
    surface: Option<&ProjectionSurface>,
    model: &Model,
    [x, y]: [f64; 2],
    depth: f64,
) -> Option<[f64; 2]> {
    match surface {
        Some(surface) => Some(surface.project(model.transform(x, y, depth))),
        None => model.project(x, y, depth),
    }
}

/// The rays of a picture's pixels. Around an upright axis a column has sine and cosine of its direction, a row how far down it is and its
/// distance from the axis; the other way around if that is level.
pub(crate) struct Rays {
    transverse: bool,
    columns: Vec<[f32; 2]>,
    rows: Vec<[f32; 2]>,
}

impl Rays {
    /// That of a pixel.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        let (column, row) = (self.columns[x], self.rows[y]);
        if self.transverse {
            [column[0], row[0] * column[1], row[1] * column[1]]
        } else {
            [column[0] * row[1], row[0], column[1] * row[1]]
        }
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn rays_appear_where_they_come_from() {
        for (sphere, transverse) in [(false, false), (true, false), (false, true), (true, true)] {
            let surface = ProjectionSurface { sphere, transverse, focal: 500.0, centre: [320.0, 240.0] };
            let far =
                if transverse { [[320.0, -900.0], [600.5, 1500.25]] } else { [[-900.0, 100.0], [1700.5, 500.25]] };
            for place in [[320.0, 240.0], far[0], far[1]] {
                let ray = surface.ray(place);
                let [x, y] = surface.project([3.0 * ray[0], 3.0 * ray[1], 3.0 * ray[2]]);
                assert!((x - place[0]).abs() < 1e-9 && (y - place[1]).abs() < 1e-9, "{x} {y} instead of {place:?}");
            }
            let rays = surface.rays([-900.0, 100.0], (3, 2));
            let (ray, [x, y, z]) = (surface.ray([-898.0, 101.0]), rays.at(2, 1));
            assert!([x, y, z].iter().zip(ray.iter()).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-6));
        }
    }
}
