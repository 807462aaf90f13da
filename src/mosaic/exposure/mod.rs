//! Matching the target's exposure to the reference's, in linear light.

mod apply;
mod fit;
mod samples;
mod tone;

use super::Exposure;
use super::canvas::Placed;
use super::span::Span;
use crate::srgb::linear_light;
use crate::{Image, Result};

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
    let linear = linear_light();
    let samples = samples::collect(image, reference, &linear, &mut span.part(0.0, 0.5))?;
    let Some(response) = fit::fit(&samples, (image.width(), image.height()), exposure == Exposure::Field)? else {
        return Ok([1.0; 3]);
    };
    apply::apply(image, &response, &linear, &mut span.part(0.5, 1.0))?;
    Ok(response.gains)
}
