//! The reference on a cylinder or a sphere: shown so, it takes the place of the photo. By default that is where the plane would
//! stretch the target very much.

use nalgebra::{Matrix3, Vector3};

use super::align::Alignment;
use super::memory::Memory;
use super::options::Options;
use super::picture::{MOST_ENLARGED, Picture, Placed, Viewer};
use crate::geometry::{Estimate, Match, Model, pair_focal};
use crate::image::{filled, zeroed};
use crate::observer::Observer;
use crate::rect::diagonal;
use crate::statistics::{median, nth};
use crate::warp::{Projection, ProjectionSurface, WarpJob, WarpOptions, project, warp_within};
use crate::{Image, ImageView, InverseDepth, Mask, Result, View};

/// The reference as it appears on a projection surface: transparent where it shows nothing.
pub(super) struct ProjectedReference {
    image: Image,
    /// Inverse depth along the rays of the projection surface; `None` without parallax.
    depth: Option<InverseDepth>,
    /// Where its depth is reliable, if that is known.
    pub reliable: Option<Mask>,
    /// From its pixels to the rays.
    turn: Model,
    /// What it is shown on.
    pub projection: Projection,
    /// Where the rays appear in its picture.
    pub surface: ProjectionSurface,
    /// From the target to the rays, and back.
    pub models: [Model; 2],
}

impl ProjectedReference {
    /// `None` where they are shown on the reference's plane.
    ///
    /// # Errors
    /// `too-large`, `out-of-memory`, `aborted`.
    pub fn of(
        alignment: &Alignment<'_>,
        matches: &[Match],
        [target, reference]: [View<'_>; 2],
        options: &Options,
        memory: &Memory<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Self>> {
        let placed = [placed(alignment, matches, target.image), Placed::reference(reference.image.size())];
        let picture = picture_of(placed, &alignment.geometry, matches, options);
        if picture.surface.is_none() {
            return Ok(None);
        }
        let memory = &memory.projecting();
        let (image, at) = shown(&picture, reference.image, options, memory, observer)?;
        let Estimate { forward, reverse, .. } = &alignment.geometry;
        let models = picture.models([forward, reverse], at);
        let Some(surface) = picture.surface_at(at) else { return Ok(None) };
        let back = &picture.back;
        let [_, reference] = alignment.views(target, reference);
        let depth = reference.depth.map(|depth| carried_depth(depth, &image, &surface, back)).transpose()?;
        let reliable =
            alignment.reliable.as_ref().map(|mask| carried_mask(mask, &image, &surface, back)).transpose()?;
        Ok(Some(Self {
            image,
            depth,
            reliable,
            turn: Model::homography(picture.turn),
            projection: picture.projection(),
            surface,
            models,
        }))
    }

    /// It, in place of the photo.
    pub fn view(&self) -> View<'_> {
        View { image: self.image.view(), depth: self.depth.as_ref() }
    }

    /// Where a point of the photo appears on it.
    pub fn place(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        project(Some(&self.surface), &self.turn, point, 0.0)
    }

    /// The picture of it.
    pub fn into_image(self) -> Image {
        self.image
    }
}

/// What both photos are shown on: the plane where it is asked for, or suits, or the photos' cameras are not known well enough for anything else.
pub(super) fn picture_of(
    [target, reference]: [Placed; 2],
    geometry: &Estimate,
    matches: &[Match],
    options: &Options,
) -> Picture {
    let plane = match options.projection {
        Some(projection) => projection == Projection::Plane,
        None => suits_plane(&target, geometry, matches),
    };
    if plane {
        return Picture::plane();
    }
    let viewer = viewer(geometry, matches, [target.size, reference.size], options);
    Picture::around(options.projection, &viewer, &reference, &[target, reference]).unwrap_or_else(Picture::plane)
}

/// Where the target is in the reference's view.
fn placed(alignment: &Alignment<'_>, matches: &[Match], target: ImageView<'_>) -> Placed {
    let depth = alignment.depth[0].as_ref().and_then(|map| {
        let depths = alignment.geometry.inliers_of(matches).map(|m| map.sample(m.target[0], m.target[1]));
        median(depths.filter(|depth| !depth.is_nan()).collect())
    });
    Placed { size: target.size(), model: alignment.geometry.forward, depth: depth.unwrap_or(0.0) }
}

/// Whether the target can be shown on the reference's plane without being stretched much next to its overlap.
fn suits_plane(target: &Placed, geometry: &Estimate, matches: &[Match]) -> bool {
    let plane = Picture::plane();
    let areas = plane.areas(target);
    let most = areas.len() * 9 / 10;
    let overlap = median(plane.areas_at(target, geometry.inliers_of(matches).map(|m| m.target), |_| target.depth));
    nth(areas, most).zip(overlap).is_none_or(|(area, overlap)| area <= MOST_ENLARGED * overlap)
}

/// The reference's camera, held upright: its focal length as given or found, otherwise self-calibrated.
fn viewer(geometry: &Estimate, matches: &[Match], sizes: [(usize, usize); 2], options: &Options) -> Viewer {
    // Given or found is the target's: the reference's is the same share of its diagonal.
    let known = options.estimate.focal.or(geometry.focal).map(|focal| focal / diagonal(sizes[0]) * diagonal(sizes[1]));
    let focal = known.unwrap_or_else(|| pair_focal(sizes, &geometry.forward, geometry.kind, matches));
    Viewer::upright(sizes[1], focal)
}

/// The reference on the projection surface, and where its first pixel is there.
fn shown(
    picture: &Picture,
    reference: ImageView<'_>,
    options: &Options,
    memory: &Memory<'_>,
    observer: &mut dyn Observer,
) -> Result<(Image, [i64; 2])> {
    let itself = Model::homography(Matrix3::identity());
    let [forward, reverse] = picture.models([&itself; 2], [0; 2]);
    let nothing = Image::transparent(1, 1)?;
    let views = [reference, nothing.view()].map(|image| View { image, depth: None });
    let job = WarpJob { surface: picture.surface_at([0; 2]), ..WarpJob::new(views, &forward, &reverse) };
    let options = WarpOptions { depth: false, ..options.warp.clone() };
    let warped = warp_within(&job, &options, &|canvas| memory.check(canvas), observer)?;
    let (left, top) = warped.offset;
    Ok((warped.image, [-(left as i64), -(top as i64)]))
}

/// Calls `put` with every pixel that `image` shows, where that is in the photo, and the third coordinate of that place.
fn for_each_place(
    image: &Image,
    surface: &ProjectionSurface,
    back: &Matrix3<f64>,
    put: &mut dyn FnMut(usize, [f64; 2], f64),
) {
    let (width, rays) = (image.width(), surface.rays([0.0; 2], image.size()));
    for (i, _) in image.pixels().iter().enumerate().filter(|(_, pixel)| pixel[3] != 0) {
        let ray = rays.at(i % width, i / width).map(f64::from);
        let [x, y, third] = (back * Vector3::from(ray)).into();
        if third > 0.0 {
            put(i, [x / third, y / third], third);
        }
    }
}

/// A photo's inverse depth where `image` shows it; NaN elsewhere.
fn carried_depth(
    depth: &InverseDepth,
    image: &Image,
    surface: &ProjectionSurface,
    back: &Matrix3<f64>,
) -> Result<InverseDepth> {
    let mut values = filled(image.width() * image.height(), f32::NAN)?;
    for_each_place(image, surface, back, &mut |i, [x, y], third| values[i] = (depth.sample(x, y) * third) as f32);
    Ok(InverseDepth::from_values(values, image.width(), image.height()))
}

/// A photo's mask where `image` shows it, by the nearest pixel; 0 elsewhere.
fn carried_mask(mask: &Mask, image: &Image, surface: &ProjectionSurface, back: &Matrix3<f64>) -> Result<Mask> {
    let mut marks = zeroed(image.width() * image.height())?;
    let nearest = |at: f64, side: usize| (at.round().max(0.0) as usize).min(side - 1);
    for_each_place(image, surface, back, &mut |i, [x, y], _| {
        marks[i] = mask.data()[nearest(y, mask.height()) * mask.width() + nearest(x, mask.width())];
    });
    Ok(Mask::from_bytes(marks, image.width(), image.height()))
}
