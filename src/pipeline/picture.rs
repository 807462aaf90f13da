//! What photos are shown on: the reference's own image plane, or a cylinder or sphere around its place, level and centred on
//! what the photos cover.

use nalgebra::{Matrix3, Vector3};

use crate::InverseDepth;
use crate::geometry::{Model, anisotropy};
use crate::rect::grid_points;
use crate::warp::{Projection, ProjectionSurface, project};

/// On a cylinder while nothing is farther from its middle along the axis than 45°, where it is stretched by 2: the sine.
const MOST_ON_CYLINDER: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// The axis of a cylinder is upright while nothing is farther up or down than 30°, or than to the sides: the sine.
const MOST_UPRIGHT: f64 = 0.5;
/// That of a sphere is while nothing is farther from its middle up or down than 60°, where it is stretched by 2, or than to the sides: the sine.
const MOST_UPRIGHT_ON_SPHERE: f64 = 0.866;
/// A sphere is level, so that what stands upright stays upright, while nothing is farther up or down than 75°, where it is stretched by 4: the sine.
const MOST_LEVEL: f64 = 0.966;
/// A photo is shown on the plane, where straight lines stay straight, while a tenth of it at most is enlarged there by more than this, in
/// area.
pub(super) const MOST_ENLARGED: f64 = 4.5;
/// Points a row and a column of a photo that are looked at.
const POINTS: usize = 9;

/// Width and height in pixels.
pub(super) type Size = (usize, usize);

/// Where a photo is in the reference's view.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub size: Size,
    /// To the reference's pixels.
    pub model: Model,
    /// The typical inverse depth of what it shows; 0 without parallax.
    pub depth: f64,
}

impl Placed {
    /// The reference itself.
    pub fn reference(size: Size) -> Self {
        Self { size, model: Model::homography(Matrix3::identity()), depth: 0.0 }
    }
}

/// The reference's camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewer {
    /// The calibration matrix K, and its inverse.
    pub calibration: [Matrix3<f64>; 2],
    /// In pixels.
    pub focal: f64,
    /// Which way is down, in the camera's axes: of length 1.
    pub down: Vector3<f64>,
}

impl Viewer {
    /// A camera held upright, with square pixels and the principal point in the middle.
    pub fn upright(size: Size, focal: f64) -> Self {
        let [cx, cy] = [size.0, size.1].map(|side| 0.5 * (side as f64 - 1.0));
        let own = Matrix3::new(focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0);
        let inverse = Matrix3::new(1.0, 0.0, -cx, 0.0, 1.0, -cy, 0.0, 0.0, focal) / focal;
        Self { calibration: [own, inverse], focal, down: Vector3::y() }
    }
}

/// The picture's surface.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    /// From the reference's pixels to the rays of the projection surface.
    pub turn: Matrix3<f64>,
    /// From those rays to the reference's pixels.
    pub back: Matrix3<f64>,
    /// `None`: the reference's own plane.
    pub surface: Option<ProjectionSurface>,
}

impl Picture {
    /// The reference's own image plane.
    pub fn plane() -> Self {
        Self { turn: Matrix3::identity(), back: Matrix3::identity(), surface: None }
    }

    /// A cylinder or a sphere, or whichever suits the `photos`, of which the `reference` is one.
    pub fn around(wanted: Option<Projection>, viewer: &Viewer, reference: &Placed, photos: &[Placed]) -> Option<Self> {
        let Viewer { calibration: [to_pixels, to_rays], focal, down } = *viewer;
        let mut rays = Vec::new();
        for Placed { size, model, depth } in photos {
            for [x, y] in grid_points(*size, POINTS) {
                rays.push(unit(to_rays * Vector3::from(model.transform(x, y, *depth)))?);
            }
        }
        let Axes { rotation, sphere, transverse } = Axes::suiting(wanted, &rays, down)?;
        let surface = ProjectionSurface { sphere, transverse, focal, centre: [0.0; 2] };
        let (turn, back) = (rotation.transpose() * to_rays, to_pixels * rotation);
        Self { turn, back, surface: Some(surface) }.with_origin_at(reference)
    }

    /// With the top left of the `reference` as the origin.
    fn with_origin_at(self, reference: &Placed) -> Option<Self> {
        let Some(surface) = self.surface else { return Some(self) };
        let unmoved = Self { surface: Some(ProjectionSurface { centre: [0.0; 2], ..surface }), ..self };
        let [x, y, ..] = unmoved.bounds(reference)?;
        let surface = Some(ProjectionSurface { centre: [-(x as f64), -(y as f64)], ..surface });
        Some(Self { surface, ..unmoved })
    }

    /// The same of photos that are `factor` times as large: the `reference`, around the same middle as when it had the size `before`.
    pub fn resized(&self, factor: f64, before: Size, reference: Size) -> Option<Self> {
        let Some(surface) = self.surface else { return Some(self.clone()) };
        let middle = |(w, h): Size| [w, h].map(|side| 0.5 * (side as f64 - 1.0));
        let scaled = |factor: f64, from: [f64; 2], to: [f64; 2]| {
            Matrix3::new(factor, 0.0, to[0] - factor * from[0], 0.0, factor, to[1] - factor * from[1], 0.0, 0.0, 1.0)
        };
        let (from, to) = (middle(before), middle(reference));
        let (turn, back) = (self.turn * scaled(1.0 / factor, to, from), scaled(factor, from, to) * self.back);
        let surface = ProjectionSurface { focal: factor * surface.focal, ..surface };
        Self { turn, back, surface: Some(surface) }.with_origin_at(&Placed::reference(reference))
    }

    /// What it is.
    pub fn projection(&self) -> Projection {
        match self.surface {
            None => Projection::Plane,
            Some(surface) if surface.sphere => Projection::Sphere,
            Some(_) => Projection::Cylinder,
        }
    }

    /// The maps from a photo to the rays of the projection surface, or the pixels of the plane, and back, by those to the reference and back, for a
    /// picture whose first pixel is at `at`.
    pub fn models(&self, [forward, reverse]: [&Model; 2], at: [i64; 2]) -> [Model; 2] {
        let (mut turn, mut back) = (self.turn, self.back);
        if self.surface.is_none() {
            let [x, y] = at.map(|v| v as f64);
            (turn[(0, 2)], turn[(1, 2)], back[(0, 2)], back[(1, 2)]) = (-x, -y, x, y);
        }
        [Model { h: turn * forward.h, e: turn * forward.e }, Model { h: reverse.h * back, e: reverse.e }]
    }

    /// The projection surface of a picture whose first pixel is at `at`.
    pub fn surface_at(&self, at: [i64; 2]) -> Option<ProjectionSurface> {
        let moved = |surface: ProjectionSurface| ProjectionSurface {
            centre: [0, 1].map(|k| surface.centre[k] - at[k] as f64),
            ..surface
        };
        self.surface.map(moved)
    }

    /// Where the pixels of a photo appear, by their inverse depth; `model` leads to the reference.
    pub fn place(&self, model: &Model) -> impl Fn([f64; 2], f64) -> Option<[f64; 2]> + use<> {
        let (model, surface) = (Model { h: self.turn * model.h, e: self.turn * model.e }, self.surface);
        move |point, depth| project(surface.as_ref(), &model, point, depth)
    }

    /// Mean [`anisotropy`] of a photo with the inverse depth that a point has.
    pub fn anisotropy(&self, photo: &Placed, depth: impl Fn([f64; 2]) -> f64) -> f64 {
        let place = self.place(&photo.model);
        anisotropy(photo.size, &|x, y| place([x, y], depth([x, y]))).unwrap_or(0.0)
    }

    /// About where a photo appears: smallest and largest x and y. `None` where part of it is behind the plane.
    pub fn bounds(&self, photo: &Placed) -> Option<[i64; 4]> {
        let place = self.place(&photo.model);
        let mut bounds = [f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
        for point in grid_points(photo.size, POINTS) {
            let [x, y] = place(point, photo.depth)?;
            bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
        }
        // The conversion saturates.
        bounds.iter().all(|v| v.is_finite()).then(|| bounds.map(|v| v.floor() as i64))
    }

    /// By how much a photo's area grows, at points all over it; infinite where it is behind the plane or turned over.
    pub fn areas(&self, photo: &Placed) -> Vec<f64> {
        self.areas_at(photo, grid_points(photo.size, POINTS), |_| photo.depth)
    }

    /// The same with the inverse depth that each pixel of the photo has; the typical one where that is NaN.
    pub fn areas_with(&self, photo: &Placed, depth: &InverseDepth) -> Vec<f64> {
        self.areas_at(photo, grid_points(photo.size, POINTS), |[x, y]| {
            Some(depth.sample(x, y)).filter(|depth| !depth.is_nan()).unwrap_or(photo.depth)
        })
    }

    /// The same at these points of the photo, with the inverse depth that a point has.
    pub fn areas_at(
        &self,
        photo: &Placed,
        points: impl Iterator<Item = [f64; 2]>,
        depth: impl Fn([f64; 2]) -> f64,
    ) -> Vec<f64> {
        let place = self.place(&photo.model);
        let place = |point: [f64; 2]| place(point, depth(point));
        let area = |[x, y]: [f64; 2]| {
            let (a, b, c) = (place([x, y])?, place([x + 1.0, y])?, place([x, y + 1.0])?);
            Some((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).filter(|area| *area > 0.0)
        };
        points.map(|point| area(point).unwrap_or(f64::INFINITY)).collect()
    }
}

/// How a projection surface is placed around the viewer.
struct Axes {
    /// From its axes, to the right, down and ahead, to the camera's.
    rotation: Matrix3<f64>,
    sphere: bool,
    transverse: bool,
}

impl Axes {
    /// For a projection surface, as it is wanted or as suits `rays` of length 1 to all that is shown; `down` is which way is down.
    fn suiting(wanted: Option<Projection>, rays: &[Vector3<f64>], down: Vector3<f64>) -> Option<Self> {
        let middle = rays.iter().sum::<Vector3<f64>>() / rays.len() as f64;
        // What is all around has no middle.
        let ahead = unit(middle).unwrap_or_else(Vector3::z);
        // Looking straight up or down, the camera's own.
        let right = unit(down.cross(&ahead)).or_else(|| unit(Vector3::x() - ahead * ahead.x))?;
        let farthest = |axis: Vector3<f64>| rays.iter().map(|ray| ray.dot(&axis).abs()).fold(0.0, f64::max);
        let (high, wide) = (farthest(down), farthest(right));
        let sphere = match wanted {
            Some(wanted) => wanted == Projection::Sphere,
            None => high.min(wide) > MOST_ON_CYLINDER,
        };
        // The middle of the picture is level, unless too much is far up or down.
        let tilted = ahead.cross(&right);
        let transverse = match sphere {
            true => high.min(farthest(tilted)) > wide.max(MOST_UPRIGHT_ON_SPHERE),
            false => high > wide.max(MOST_UPRIGHT),
        };
        let down = if transverse || sphere && high > MOST_LEVEL { tilted } else { down };
        let rotation = Matrix3::from_columns(&[right, down, right.cross(&down)]);
        Some(Self { rotation, sphere, transverse })
    }
}

/// The share of points all over a photo that meet a `condition`.
pub(super) fn share_of_points(size: Size, condition: impl Fn([f64; 2]) -> bool) -> f64 {
    grid_points(size, POINTS).filter(|point| condition(*point)).count() as f64 / (POINTS * POINTS) as f64
}

/// Scaled to length 1; `None` of nothing.
pub(super) fn unit(v: Vector3<f64>) -> Option<Vector3<f64>> {
    let length = v.norm();
    (length > 1e-6).then(|| v / length)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    /// Rays to the sides by 50° and from 20° down to so many degrees up.
    fn rays(up: f64) -> Vec<Vector3<f64>> {
        let direction = |yaw: f64, pitch: f64| {
            let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
            let across = libm::cos(pitch);
            Vector3::new(libm::sin(yaw) * across, -libm::sin(pitch), libm::cos(yaw) * across)
        };
        let at = |i: u32, from: f64, to: f64| from + (to - from) * f64::from(i) / 20.0;
        (0..=20).flat_map(|i| (0..=20).map(move |j| direction(at(i, -50.0, 50.0), at(j, -20.0, up)))).collect()
    }

    #[test]
    fn a_sphere_is_level_until_too_much_is_far_up() {
        for (up, level) in [(60.0, true), (70.0, true), (85.0, false)] {
            let axes = Axes::suiting(None, &rays(up), Vector3::y()).unwrap();
            assert!(axes.sphere && !axes.transverse, "{up}");
            let down = axes.rotation.column(1)[1];
            assert_eq!(down > 1.0 - 1e-9, level, "{up}: {down}");
        }
    }
}
