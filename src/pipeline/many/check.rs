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
    check_focal(options.stages.estimate.focal)?;
    options.stages.check()?;
    for (i, photo) in photos.iter().enumerate() {
        check_photo(photo).map_err(Error::of_photo(i))?;
    }
    check_cameras(photos)?;
    let mut budget = check_sizes(photos.iter().map(|photo| photo.image.size()), options)?;
    let masked = photos.iter().map(|photo| photo.image).filter(ImageView::is_masked);
    masked.for_each(|image| budget.add_masked(image.size()));
    photos.iter().filter(|photo| photo.depth.is_some()).for_each(|photo| budget.add_depth(photo.image.size()));
    budget.check((0, 0))?;
    Ok(budget)
}

/// How far a rotation may be from one: the largest element of RᵀR − I.
const ROTATION: f64 = 1e-3;

fn invalid(name: &'static str, expected: &'static str, value: f64) -> Result<()> {
    Err(Error::InvalidArgument { name, expected, value }.into())
}

fn check_focal(focal: Option<f64>) -> Result<()> {
    match focal {
        Some(value) if !(value > 0.0 && value.is_finite()) => invalid("focalLength", "a positive number", value),
        _ => Ok(()),
    }
}

/// Refuses what is wrong with one photo.
fn check_photo(photo: &Photo<'_>) -> Result<()> {
    check_focal(photo.focal)?;
    if let Some(depth) = photo.depth {
        check_size("depth", depth.size(), photo.image.size())?;
    }
    let Some(Camera { rotation, translation }) = photo.camera else { return Ok(()) };
    if photo.focal.is_none() {
        return Err(Error::Missing { name: "focalLength", reason: "every camera needs one" }.into());
    }
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
    Ok(())
}

/// Refuses cameras of some photos alone.
fn check_cameras(photos: &[Photo<'_>]) -> Result<()> {
    let cameras = photos.iter().filter(|photo| photo.camera.is_some()).count();
    if cameras == 0 || cameras == photos.len() {
        return Ok(());
    }
    invalid("camera", "given for every photo or for none", cameras as f64)
}

/// As [`check`], by the photos' sizes alone.
pub(crate) fn check_sizes(
    sizes: impl ExactSizeIterator<Item = (usize, usize)>,
    options: &ManyOptions,
) -> Result<Budget<'_>> {
    let count = sizes.len();
    check_count(count)?;
    if let Some(reference) = options.reference.filter(|reference| *reference >= count) {
        invalid("reference", "the index of a photo", reference as f64)?;
    }
    if let Some(value) = options.distortion.filter(|known| known.is_nan() || known.abs() > Distortion::MOST) {
        invalid("distortion", "from -1 to 1", value)?;
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
    invalid("photos", "from 2 to 30 photos", count as f64)
}
