//! What the photos are shown on: the reference's own image plane, or a cylinder or sphere around its place, level and centred on
//! what the photos cover.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Model, MultiView, eigenpairs};
use crate::statistics::median;
use crate::warp::{Projection, Screen, project};

/// Photos are shown on the plane while none of them is stretched by more than this anywhere, in area: away from the middle by 2,
/// across that by √2.
const MOST_ON_PLANE: f64 = 2.83;
/// On a cylinder while nothing is farther up or down than 45°, where it is stretched by 2: the sine.
const MOST_ON_CYLINDER: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// A sphere is level while nothing is farther up or down than 60°, where it is stretched by 2: the sine.
const MOST_LEVEL: f64 = 0.866;
/// How much the cameras' own uprights count next to what their horizontal axes say.
const OWN_UPRIGHT: f64 = 0.01;
/// Points a row and a column of a photo that are looked at.
const POINTS: usize = 9;

/// Width and height in pixels.
pub(super) type Size = (usize, usize);

/// The picture's surface.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    pub reference: usize,
    /// From the reference's pixels to the rays of the screen, and back.
    turn: Matrix3<f64>,
    back: Matrix3<f64>,
    /// `None`: the reference's own plane.
    pub screen: Option<Screen>,
}

impl Picture {
    /// The reference's own image plane.
    pub fn plane(reference: usize) -> Self {
        Self { reference, turn: Matrix3::identity(), back: Matrix3::identity(), screen: None }
    }

    /// The surface that is wanted, or that suits what the photos cover. Without cameras it is the plane.
    pub fn choose(
        wanted: Option<Projection>,
        reference: usize,
        photos: &[usize],
        sizes: &[Size],
        geometry: &MultiView,
    ) -> Self {
        let plane = Self::plane(reference);
        let suits = |photo: &usize| {
            let areas = plane.areas(*photo, sizes, geometry);
            let most = MOST_ON_PLANE * zoom(geometry, [*photo, reference]);
            areas.is_some_and(|areas| areas.iter().all(|area| *area <= most))
        };
        if wanted == Some(Projection::Plane) || wanted.is_none() && photos.iter().all(suits) {
            return plane;
        }
        Self::around(wanted, reference, photos, sizes, geometry).unwrap_or(plane)
    }

    /// A cylinder or a sphere.
    fn around(
        wanted: Option<Projection>,
        reference: usize,
        photos: &[usize],
        sizes: &[Size],
        geometry: &MultiView,
    ) -> Option<Self> {
        let [to_pixels, to_rays] = geometry.calibration(reference)?;
        let mut rays = Vec::new();
        let mut sum = Vector3::zeros();
        for &photo in photos {
            let (model, depth) = (geometry.model([photo, reference])?, typical_depth(geometry, [photo, reference]));
            for [x, y] in grid(sizes[photo]) {
                let ray = unit(to_rays * Vector3::from(model.transform(x, y, depth)))?;
                rays.push(ray);
                sum += ray;
            }
        }
        let down = downwards(reference, photos, geometry)?;
        let highest = rays.iter().map(|ray| ray.dot(&down).abs()).fold(0.0, f64::max);
        let sphere = match wanted {
            Some(wanted) => wanted == Projection::Sphere,
            None => highest > MOST_ON_CYLINDER,
        };
        // Where the middle of the picture is, and what is upright there.
        let across = |v: Vector3<f64>, w: Vector3<f64>| unit(v - w * w.dot(&v));
        let (ahead, down) = if sphere && highest > MOST_LEVEL {
            let ahead = unit(sum)?;
            (ahead, across(down, ahead)?)
        } else {
            (across(sum, down).or(across(Vector3::z(), down))?, down)
        };
        let rotation = Matrix3::from_columns(&[down.cross(&ahead), down, ahead]);
        let screen = Screen { sphere, focal: geometry.focal(reference)?, centre: [0.0; 2] };
        let (turn, back) = (rotation.transpose() * to_rays, to_pixels * rotation);
        let mut found = Self { reference, turn, back, screen: Some(screen) };
        // The reference's top left is the origin.
        let [x, y, ..] = found.bounds(reference, sizes, geometry)?;
        found.screen = Some(Screen { centre: [-(x as f64), -(y as f64)], ..screen });
        Some(found)
    }

    /// What it is.
    pub fn projection(&self) -> Projection {
        match self.screen {
            None => Projection::Plane,
            Some(screen) if screen.sphere => Projection::Sphere,
            Some(_) => Projection::Cylinder,
        }
    }

    /// The maps from a photo to the rays of the screen, or the pixels of the plane, and back, for a picture whose first pixel is at
    /// `at`.
    pub fn models(&self, geometry: &MultiView, photo: usize, at: [i64; 2]) -> Option<[Model; 2]> {
        let [forward, reverse] = if photo == self.reference {
            [Model::homography(Matrix3::identity()); 2]
        } else {
            [geometry.model([photo, self.reference])?, geometry.model([self.reference, photo])?]
        };
        let (mut turn, mut back) = (self.turn, self.back);
        if self.screen.is_none() {
            let [x, y] = at.map(|v| v as f64);
            (turn[(0, 2)], turn[(1, 2)], back[(0, 2)], back[(1, 2)]) = (-x, -y, x, y);
        }
        let forward = Model { h: turn * forward.h, e: turn * forward.e };
        Some([forward, Model { h: reverse.h * back, e: reverse.e }])
    }

    /// The screen of a picture whose first pixel is at `at`.
    pub fn screen_at(&self, at: [i64; 2]) -> Option<Screen> {
        let moved = |screen: Screen| Screen { centre: [0, 1].map(|k| screen.centre[k] - at[k] as f64), ..screen };
        self.screen.map(moved)
    }

    fn project(&self, model: &Model, [x, y]: [f64; 2], depth: f64) -> Option<[f64; 2]> {
        project(self.screen.as_ref(), model, [x, y], depth)
    }

    /// About where a photo appears: smallest and largest x and y. `None` without a place, and where part of it is behind the plane.
    pub fn bounds(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<[i64; 4]> {
        let ([model, _], depth) =
            (self.models(geometry, photo, [0; 2])?, typical_depth(geometry, [photo, self.reference]));
        let mut bounds = [f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
        for point in grid(sizes[photo]) {
            let [x, y] = self.project(&model, point, depth)?;
            bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
        }
        // The conversion saturates.
        bounds.iter().all(|v| v.is_finite()).then(|| bounds.map(|v| v.floor() as i64))
    }

    /// By how much a photo's area grows, at its points; infinite where it is behind the plane or turned over. `None` without a
    /// place.
    fn areas(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<Vec<f64>> {
        let ([model, _], depth) =
            (self.models(geometry, photo, [0; 2])?, typical_depth(geometry, [photo, self.reference]));
        let area = |[x, y]: [f64; 2]| {
            let place = |x, y| self.project(&model, [x, y], depth);
            let (a, b, c) = (place(x, y)?, place(x + 1.0, y)?, place(x, y + 1.0)?);
            Some((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).filter(|area| *area > 0.0)
        };
        Some(grid(sizes[photo]).map(|point| area(point).unwrap_or(f64::INFINITY)).collect())
    }

    /// By how much a photo's area grows, at the median, next to how much longer the reference's lens is; `None` where most of it is
    /// behind the plane or turned over.
    pub fn stretch(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<f64> {
        let median = median(self.areas(photo, sizes, geometry)?)?;
        Some(median / zoom(geometry, [photo, self.reference])).filter(|area| area.is_finite())
    }
}

/// Points all over a photo, its corners among them.
fn grid((w, h): Size) -> impl Iterator<Item = [f64; 2]> {
    let at = |k: usize, side: usize| k as f64 / (POINTS - 1) as f64 * (side as f64 - 1.0);
    (0..POINTS * POINTS).map(move |k| [at(k % POINTS, w), at(k / POINTS, h)])
}

/// By how much a photo is enlarged, in area, as the reference has a longer lens: that is no stretch.
fn zoom(geometry: &MultiView, [photo, reference]: [usize; 2]) -> f64 {
    match (geometry.focal(reference), geometry.focal(photo)) {
        (Some(of_reference), Some(own)) => (of_reference / own) * (of_reference / own),
        _ => 1.0,
    }
}

/// The median inverse depth of a photo's landmarks; 0 without parallax.
pub(super) fn typical_depth(geometry: &MultiView, [photo, other]: [usize; 2]) -> f64 {
    median(geometry.samples(photo, other).iter().map(|s| s.depth).collect()).unwrap_or(0.0)
}

/// Which way is down, in the reference's axes: at right angles to all cameras' horizontal axes, as far as these differ (Brown & Lowe,
/// *Automatic Panoramic Image Stitching using Invariant Features*, 2007, section 5), and otherwise as the cameras were held.
fn downwards(reference: usize, photos: &[usize], geometry: &MultiView) -> Option<Vector3<f64>> {
    let own = geometry.camera(reference)?.rotation;
    let (mut across, mut held, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for camera in photos.iter().filter_map(|&photo| geometry.camera(photo)) {
        let turn = own * camera.rotation.transpose();
        across += turn.column(0) * turn.column(0).transpose();
        held += turn.column(1);
        count += 1.0;
    }
    let held = unit(held)?;
    let others = Matrix3::identity() - held * held.transpose();
    let [.., (_, down)] = eigenpairs(&(across + others * (OWN_UPRIGHT * count)))?;
    let down = if down.dot(&held) < 0.0 { -down } else { down };
    // Cameras held on their side say nothing of the horizon.
    Some(if down.dot(&held) > std::f64::consts::FRAC_1_SQRT_2 { down } else { held })
}

/// Scaled to length 1; `None` of nothing.
fn unit(v: Vector3<f64>) -> Option<Vector3<f64>> {
    let length = v.norm();
    (length > 1e-6).then(|| v / length)
}
