//! What cannot be stitched is refused before any memory is taken.

use nalgebra::Matrix3;

use super::ManyOptions;
use super::memory::Budget;
use super::result::Photo;
use crate::geometry::{Camera, Distortion};
use crate::image::check_size;
use crate::{Error, ImageView, Result};

/// Fewest and most photos.
const PHOTOS: std::ops::RangeInclusive<usize> = 2..=30;

/// Refuses what cannot be stitched; the memory that the rest may take.
pub(super) fn check<'a>(photos: &[Photo<'_>], options: &'a ManyOptions) -> Result<Budget<'a>> {
    for value in photos.iter().filter_map(|photo| photo.focal).chain(options.stages.estimate.focal) {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::InvalidArgument { name: "focalLength", expected: "a positive number", value }.into());
        }
    }
    options.stages.blend.check()?;
    check_cameras(photos)?;
    for (photo, depth) in photos.iter().filter_map(|photo| Some((photo, photo.depth?))) {
        check_size("depth", depth.size(), photo.image.size())?;
    }
    let mut budget = check_sizes(photos.iter().map(|photo| photo.image.size()), options)?;
    let masked = photos.iter().map(|photo| photo.image).filter(ImageView::is_masked);
    masked.for_each(|image| budget.add_masked(image.size()));
    photos.iter().filter(|photo| photo.depth.is_some()).for_each(|photo| budget.add_depth(photo.image.size()));
    budget.check((0, 0))?;
    Ok(budget)
}

/// How far a rotation may be from one: the largest element of RᵀR − I.
const ROTATION: f64 = 1e-3;

/// Refuses cameras of some photos alone, or without a focal length, and what is no rotation.
fn check_cameras(photos: &[Photo<'_>]) -> Result<()> {
    let cameras: Vec<Camera> = photos.iter().filter_map(|photo| photo.camera).collect();
    if cameras.is_empty() {
        return Ok(());
    }
    let invalid = |name, expected, value| Err(Error::InvalidArgument { name, expected, value }.into());
    if cameras.len() < photos.len() {
        return invalid("camera", "given for every photo or for none", cameras.len() as f64);
    }
    if photos.iter().any(|photo| photo.focal.is_none()) {
        return Err(Error::Missing { name: "focalLength", reason: "every camera needs one" }.into());
    }
    for Camera { rotation, translation } in cameras {
        let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
        // `amax` passes over what is not a number.
        if let Some(value) = rotation.iter().copied().find(|value| !value.is_finite()) {
            return invalid("rotation", "nine finite numbers", value);
        }
        if off > ROTATION {
            return invalid("rotation", "orthogonal: RᵀR within 0.001 of the identity", off);
        }
        if rotation.determinant() < 0.0 {
            return invalid("rotation", "a rotation, with determinant 1", rotation.determinant());
        }
        if let Some(value) = translation.iter().copied().find(|value| !value.is_finite()) {
            return invalid("translation", "three finite numbers", value);
        }
    }
    Ok(())
}

/// As [`check`], by the photos' sizes alone.
pub(crate) fn check_sizes(
    sizes: impl ExactSizeIterator<Item = (usize, usize)>,
    options: &ManyOptions,
) -> Result<Budget<'_>> {
    let count = sizes.len();
    check_count(count)?;
    if let Some(reference) = options.reference.filter(|reference| *reference >= count) {
        return Err(Error::InvalidArgument {
            name: "reference",
            expected: "the index of a photo",
            value: reference as f64,
        }
        .into());
    }
    if let Some(value) = options.distortion.filter(|known| known.is_nan() || known.abs() > Distortion::MOST) {
        return Err(Error::InvalidArgument { name: "distortion", expected: "from -1 to 1", value }.into());
    }
    let budget = Budget::of(sizes, &options.stages);
    budget.check((0, 0))?;
    Ok(budget)
}

/// Refuses too few photos, and too many.
pub(crate) fn check_count(count: usize) -> Result<()> {
    if PHOTOS.contains(&count) {
        return Ok(());
    }
    Err(Error::InvalidArgument { name: "photos", expected: "from 2 to 30 photos", value: count as f64 }.into())
}
