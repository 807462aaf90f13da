//! Matching the target's exposure to the reference's, in linear light.

mod apply;
mod fit;
mod samples;
mod tone;

pub(crate) use tone::linear_light;

use super::canvas::Placed;
use super::span::Span;
use super::{Exposure, check_canvas};
use crate::observer::Observer;
use crate::warp::Warped;
use crate::{Image, ImageView, Result};

/// Matches the warped target's exposure to the reference's where [`super::blend`] is asked to do no more: returns the
/// adjusted target and the gains of [`super::Mosaic`].
///
/// # Errors
/// `size-mismatch` when the reference does not fit the canvas, `out-of-memory`, `aborted`.
pub fn compensate(
    warped: &Warped,
    reference: ImageView<'_>,
    exposure: Exposure,
    observer: &mut dyn Observer,
) -> Result<(Image, [f64; 3])> {
    check_canvas(warped, reference)?;
    let mut image = Image::transparent(warped.image.width, warped.image.height)?;
    image.data.copy_from_slice(&warped.image.data);
    let placed = Placed { photo: reference, left: warped.offset.0, top: warped.offset.1 };
    let gains = adjust(&mut image, &placed, exposure, &mut Span { observer, from: 0.0, to: 1.0 })?;
    Ok((image, gains))
}

/// Adjusts the target in `image`; what it was multiplied by on average over the overlap.
pub(super) fn adjust(
    image: &mut Image,
    reference: &Placed<'_>,
    exposure: Exposure,
    span: &mut Span<'_>,
) -> Result<[f64; 3]> {
    if exposure == Exposure::Off {
        return Ok([1.0; 3]);
    }
    let linear = tone::linear_light();
    let samples = samples::collect(image, reference, &linear, &mut span.part(0.0, 0.5))?;
    let Some(response) = fit::fit(&samples, (image.width, image.height), exposure == Exposure::Field)? else {
        return Ok([1.0; 3]);
    };
    apply::apply(image, &response, &linear, &mut span.part(0.5, 1.0))?;
    Ok(response.gains)
}
