//! Matching the target's exposure to the reference's, in linear light.

mod apply;
mod clipped;
mod fit;
mod samples;
mod tone;

use super::Exposure;
use super::canvas::Placed;
use crate::observer::{Observer, Portion};
use crate::srgb::linear_light;
use crate::{Error, Image, Result};

/// Refuses gains that are none.
pub(crate) fn check_gains(gains: [f64; 3]) -> Result<()> {
    match gains.into_iter().find(|gain| !(gain.is_finite() && *gain > 0.0)) {
        Some(value) => Err(Error::InvalidArgument { name: "gains", expected: "finite numbers above 0", value }.into()),
        None => Ok(()),
    }
}

/// What multiplying linear light by the gains makes of every level of red, green and blue.
pub(crate) fn gain_table(gains: [f64; 3]) -> Result<[[u8; 256]; 3]> {
    let linear = linear_light();
    let levels = tone::levels(&linear)?;
    let gained = |gain: f64, level: usize| {
        if gain == 1.0 {
            return level as u8;
        }
        tone::level_of(f64::from(linear[level]) * gain, &levels)
    };
    Ok(gains.map(|gain| std::array::from_fn(|level| gained(gain, level))))
}

/// Makes what is dark so many times brighter in linear light, what is brighter less, and white not at all (Reinhard et al., *Photographic Tone
/// Reproduction for Digital Images*, 2002, equation 4).
pub(crate) fn lift_shadows(image: &mut Image, times: f64) -> Result<()> {
    if times == 1.0 {
        return Ok(());
    }
    let linear = linear_light();
    let levels = tone::levels(&linear)?;
    let table: [u8; 256] = std::array::from_fn(|level| {
        let light = f64::from(linear[level]);
        tone::level_of(times * light / (1.0 + (times - 1.0) * light), &levels)
    });
    for [r, g, b, _] in image.pixels_mut() {
        [*r, *g, *b] = [*r, *g, *b].map(|level| table[usize::from(level)]);
    }
    Ok(())
}

/// Adjusts the target in `image`; what it was multiplied by on average over the overlap. With `joint` gains, those that all photos
/// together ask for, only what is local differs from them. No highlights are lost that the target alone shows, or with `joint` gains any.
pub(super) fn adjust(
    image: &mut Image,
    reference: &Placed<'_>,
    exposure: Exposure,
    joint: Option<[f64; 3]>,
    observer: &mut dyn Observer,
) -> Result<[f64; 3]> {
    if exposure == Exposure::Off {
        return Ok([1.0; 3]);
    }
    let linear = linear_light();
    let samples = samples::collect(image, reference, &linear, &mut Portion::new(observer, 0.0, 0.5))?;
    let fitted = fit::fit(&samples, image.size(), exposure == Exposure::Field, joint)?;
    let mut response = match (fitted, joint) {
        (Some(fitted), _) => fitted,
        (None, Some(gains)) => fit::ExposureModel::constant(gains, image.size())?,
        (None, None) => return Ok([1.0; 3]),
    };
    clipped::mark(&mut response.field, image)?;
    // Of two photos alone the reference says how bright highlights are where it shows them.
    let frame = joint.is_none().then(|| reference.frame());
    apply::apply(image, &response, frame, &linear, &mut Portion::new(observer, 0.5, 1.0))?;
    Ok(response.gains)
}

/// Multiplies the linear light of an image by these gains. No highlights are lost.
pub(super) fn multiply(image: &mut Image, gains: [f64; 3], observer: &mut dyn Observer) -> Result<()> {
    if gains == [1.0; 3] {
        return Ok(());
    }
    let mut response = fit::ExposureModel::constant(gains, image.size())?;
    clipped::mark(&mut response.field, image)?;
    apply::apply(image, &response, None, &linear_light(), observer)
}
