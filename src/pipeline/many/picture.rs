//! What many photos are shown on.

use nalgebra::{Matrix3, Vector3};

use crate::InverseDepth;
use crate::geometry::{Model, MultiView, eigenpairs};
use crate::pipeline::picture::{MOST_ENLARGED, Picture, Placed, Size, Viewer, unit};
use crate::statistics::{median, nth};
use crate::warp::{Limits, Projection, ProjectionSurface};

/// Photos are shown on the plane while none of them is stretched by more than this anywhere at its typical depth, in area: away from the
/// middle by 2, across that by √2.
const MOST_ON_PLANE: f64 = 2.83;
/// How much the cameras' own uprights count next to what their horizontal axes say.
const OWN_UPRIGHT: f64 = 0.01;

/// The picture of many photos, in the view of one of them.
#[derive(Debug, Clone)]
pub(super) struct ManyPicture {
    pub reference: usize,
    shown: Picture,
}

impl ManyPicture {
    /// The reference's own image plane.
    pub fn plane(reference: usize) -> Self {
        Self { reference, shown: Picture::plane() }
    }

    /// The surface that is wanted, or that suits what the photos cover. Without cameras, even rough ones, it is the plane.
    pub fn choose(
        wanted: Option<Projection>,
        reference: usize,
        photos: &[usize],
        sizes: &[Size],
        geometry: &MultiView,
    ) -> Self {
        let plane = Self::plane(reference);
        let suits = |photo: &usize| plane.is_little_stretched(*photo, sizes, geometry);
        if wanted == Some(Projection::Plane) || wanted.is_none() && photos.iter().all(suits) {
            return plane;
        }
        Self::around(wanted, reference, photos, sizes, geometry).unwrap_or(plane)
    }

    /// The cylinder or sphere that is wanted, or that suits what the photos cover. `None` without cameras.
    pub fn around(
        wanted: Option<Projection>,
        reference: usize,
        photos: &[usize],
        sizes: &[Size],
        geometry: &MultiView,
    ) -> Option<Self> {
        let viewer = viewer(reference, photos, geometry)?;
        let placed: Option<Vec<Placed>> =
            photos.iter().map(|&photo| placed(photo, reference, sizes, geometry)).collect();
        let shown = Picture::around(wanted, &viewer, &Placed::reference(sizes[reference]), &placed?)?;
        Some(Self { reference, shown })
    }

    /// The same of photos that are `factor` times as large and have these `sizes` now, around the same middles.
    pub fn resized(&self, factor: f64, [before, sizes]: [&[Size]; 2]) -> Option<Self> {
        let shown = self.shown.resized(factor, before[self.reference], sizes[self.reference])?;
        Some(Self { shown, ..*self })
    }

    /// Whether it can show a photo of this depth without stretching it much.
    pub fn suits(&self, photo: usize, depth: &InverseDepth, sizes: &[Size], geometry: &MultiView) -> bool {
        let Some(placed) = placed(photo, self.reference, sizes, geometry) else { return true };
        let areas = self.shown.areas_with(&placed, depth);
        let most = areas.len() * 9 / 10;
        nth(areas, most).is_none_or(|area| area <= MOST_ENLARGED * zoom(geometry, [photo, self.reference]))
    }

    /// How much more this depth distorts a photo than if everything was infinitely far away, as the difference of mean anisotropies.
    pub fn anisotropy_by_parallax(
        &self,
        photo: usize,
        depth: &InverseDepth,
        sizes: &[Size],
        geometry: &MultiView,
    ) -> f64 {
        let Some(placed) = placed(photo, self.reference, sizes, geometry) else { return 0.0 };
        let by_depth = self.shown.anisotropy(&placed, |[x, y]| depth.sample(x, y));
        by_depth - self.shown.anisotropy(&placed, |_| 0.0)
    }

    /// What it is.
    pub fn projection(&self) -> Projection {
        self.shown.projection()
    }

    /// Whether it is the reference's own image plane.
    pub fn is_plane(&self) -> bool {
        self.shown.surface.is_none()
    }

    /// The maps from a photo to the rays of the projection surface, or the pixels of the plane, and back, for a picture whose first pixel is at
    /// `at`.
    pub fn models(&self, geometry: &MultiView, photo: usize, at: [i64; 2]) -> Option<[Model; 2]> {
        let [forward, reverse] = [[photo, self.reference], [self.reference, photo]].map(|pair| geometry.model(pair));
        Some(self.shown.models([&forward?, &reverse?], at))
    }

    /// The projection surface of a picture whose first pixel is at `at`.
    pub fn surface_at(&self, at: [i64; 2]) -> Option<ProjectionSurface> {
        self.shown.surface_at(at)
    }

    /// The farthest that a photo may appear on the plane: `canvas_limit` times the reference's size beyond that, and beyond where a
    /// photo appears that is hardly stretched, as in a long row. `None` on a cylinder or sphere.
    pub fn limits(&self, photo: usize, sizes: &[Size], geometry: &MultiView, canvas_limit: f64) -> Option<Limits> {
        if !self.is_plane() {
            return None;
        }
        let reference = sizes[self.reference];
        let bounds = self.bounds(photo, sizes, geometry).filter(|_| self.is_little_stretched(photo, sizes, geometry));
        Some(match bounds {
            Some(bounds) => Limits::with(reference, bounds.map(|v| v as f64), canvas_limit),
            None => Limits::new(reference, canvas_limit),
        })
    }

    /// Whether a photo is stretched by no more than a plane may, anywhere at its typical depth.
    fn is_little_stretched(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> bool {
        let most = MOST_ON_PLANE * zoom(geometry, [photo, self.reference]);
        self.areas(photo, sizes, geometry).is_some_and(|areas| areas.iter().all(|area| *area <= most))
    }

    /// About where a photo appears: smallest and largest x and y. `None` without a place, and where part of it is behind the plane.
    pub fn bounds(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<[i64; 4]> {
        self.shown.bounds(&placed(photo, self.reference, sizes, geometry)?)
    }

    /// By how much a photo's area grows, at its points; infinite where it is behind the plane or turned over. `None` without a
    /// place.
    fn areas(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<Vec<f64>> {
        Some(self.shown.areas(&placed(photo, self.reference, sizes, geometry)?))
    }

    /// By how much a photo's area grows, at the median, next to how much longer the reference's lens is; `None` where most of it is
    /// behind the plane or turned over.
    pub fn stretch(&self, photo: usize, sizes: &[Size], geometry: &MultiView) -> Option<f64> {
        let median = median(self.areas(photo, sizes, geometry)?)?;
        Some(median / zoom(geometry, [photo, self.reference])).filter(|area| area.is_finite())
    }
}

/// Where a photo is in the reference's view; `None` without a place.
fn placed(photo: usize, reference: usize, sizes: &[Size], geometry: &MultiView) -> Option<Placed> {
    let pair = [photo, reference];
    Some(Placed { size: sizes[photo], model: geometry.model(pair)?, depth: typical_depth(geometry, pair) })
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

/// The reference's camera; `None` without cameras.
fn viewer(reference: usize, photos: &[usize], geometry: &MultiView) -> Option<Viewer> {
    Some(Viewer {
        calibration: geometry.calibration(reference)?,
        focal: geometry.focal(reference)?,
        down: downwards(reference, photos, geometry)?,
    })
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
