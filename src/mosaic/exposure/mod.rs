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
use crate::{Image, Result};

/// What multiplying linear light by the gains makes of every level of red, green and blue.
pub(crate) fn gain_table(gains: [f64; 3]) -> Result<[[u8; 256]; 3]> {
    let linear = linear_light();
    let levels = tone::levels(&linear)?;
    let last = (tone::STEPS - 1) as f64;
    let gained = |gain: f64, level: usize| {
        if gain == 1.0 {
            return level as u8;
        }
        // The conversion saturates.
        levels[((f64::from(linear[level]) * gain * last + 0.5) as usize).min(tone::STEPS - 1)]
    };
    Ok(gains.map(|gain| std::array::from_fn(|level| gained(gain, level))))
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
