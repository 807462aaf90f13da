//! What cannot be stitched is refused before any memory is taken.

use nalgebra::Matrix3;

use super::ManyOptions;
use super::memory::Budget;
use super::reduced::can_be_halved;
use super::result::Photo;
use crate::geometry::{Camera, Distortion};
use crate::image::check_size;
use crate::pipeline::halved::{are_halved, half_size};
use crate::pipeline::options::Options;
use crate::pipeline::picture::Size;
use crate::{Error, ImageView, InverseDepth, Result};

/// Fewest and most photos.
const PHOTOS: std::ops::RangeInclusive<usize> = 2..=30;

/// A lens that distorts about as much as any.
const BARREL: f64 = -0.25;

/// Refuses what cannot be stitched; the memory that the rest may take. Photos are halved before they are aligned if that is allowed, where they are
/// large, and where they would take too much memory.
pub(super) fn check<'a>(photos: &[Photo<'_>], options: &'a ManyOptions, halving: bool) -> Result<Budget<'a>> {
    check_focal(options.stages.estimate.focal)?;
    options.stages.check()?;
    for (i, photo) in photos.iter().enumerate() {
        check_photo(photo).map_err(Error::of_photo(i))?;
    }
    check_cameras(photos)?;
    check_options(photos.len(), options)?;
    let sizes: Vec<Size> = photos.iter().map(|photo| photo.image.size()).collect();
    let masked: Vec<Size> =
        photos.iter().map(|photo| photo.image).filter(ImageView::is_masked).map(|image| image.size()).collect();
    let with_depth: Vec<Size> = photos.iter().filter_map(|photo| photo.depth.map(InverseDepth::size)).collect();
    // With cameras that are given there is no distortion but what is given, too.
    let distortion = options.distortion.or(photos.first().and_then(|photo| photo.camera).map(|_| 0.0));
    fitting(&sizes, &options.stages, distortion, [halving, with_depth.is_empty()], &|budget| {
        masked.iter().for_each(|&size| budget.add_masked(size));
        with_depth.iter().for_each(|&size| budget.add_depth(size));
    })
}

/// The memory for photos of these sizes, and what they `add` to it. `alone`: without depth.
fn fitting<'a>(
    sizes: &[Size],
    stages: &'a Options,
    distortion: Option<f64>,
    [halving, alone]: [bool; 2],
    add: &dyn Fn(&mut Budget<'_>),
) -> Result<Budget<'a>> {
    let mut aligned = sizes.to_vec();
    let mut halvings = 0;
    while halving && are_halved(&aligned, alone, stages) {
        halvings += 1;
        aligned.iter_mut().for_each(|size| *size = half_size(*size));
    }
    loop {
        let mut budget = Budget::of(sizes, halvings, stages);
        add(&mut budget);
        let smaller = halving && can_be_halved(sizes, halvings + 1);
        let undistorted = match distortion {
            Some(known) => Some(known).filter(|known| *known != 0.0),
            // Where there is a choice, enough for a lens that may turn out to distort.
            None => smaller.then_some(BARREL),
        };
        let undistorted = |()| undistorted.map_or(Ok(()), |known| budget.check_undistorted(Distortion(known)));
        match budget.check((0, 0)).and_then(undistorted) {
            Ok(()) => return Ok(budget),
            Err(_) if smaller => halvings += 1,
            Err(error) => return Err(error),
        }
    }
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

/// The memory that photos may take, by their sizes alone.
#[cfg(all(target_arch = "wasm32", feature = "wasm-many"))]
pub(crate) fn check_sizes<'a>(sizes: &[Size], options: &'a ManyOptions) -> Result<Budget<'a>> {
    check_options(sizes.len(), options)?;
    fitting(sizes, &options.stages, options.distortion, [true; 2], &|_| ())
}

/// Refuses what is wrong with so many photos, and the options for them.
fn check_options(count: usize, options: &ManyOptions) -> Result<()> {
    check_count(count)?;
    if let Some(reference) = options.reference.filter(|reference| *reference >= count) {
        invalid("reference", "the index of a photo", reference as f64)?;
    }
    if let Some(value) = options.distortion.filter(|known| known.is_nan() || known.abs() > Distortion::MOST) {
        invalid("distortion", "from -1 to 1", value)?;
    }
    Ok(())
}

/// Refuses too few photos, and too many.
pub(crate) fn check_count(count: usize) -> Result<()> {
    if PHOTOS.contains(&count) {
        return Ok(());
    }
    invalid("photos", "from 2 to 30 photos", count as f64)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn photos_are_halved_where_they_are_large_or_too_many() {
        let (mut options, phone) = (Options::default(), (4032, 3024));
        let halvings = |sizes: &[Size], alone, options: &Options| {
            fitting(sizes, options, Some(0.0), [true, alone], &|_| ()).unwrap().halvings
        };
        assert_eq!(halvings(&[phone; 5], true, &options), 1);
        assert_eq!(halvings(&[(8064, 6048); 3], true, &options), 2);
        // Depth that is given is used pixel by pixel, and where one is small all are worth a look.
        assert_eq!(halvings(&[phone; 5], false, &options), 0);
        assert_eq!(halvings(&[phone, phone, (1600, 1200)], true, &options), 0);
        assert_eq!(halvings(&[phone; 16], false, &options), 1);
        options.warp.max_bytes = 1 << 30;
        assert_eq!(halvings(&[phone; 16], true, &options), 2);
        assert!(fitting(&[phone; 5], &options, Some(0.0), [false, true], &|_| ()).is_err());
    }
}
