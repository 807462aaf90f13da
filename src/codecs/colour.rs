//! From one colour space to another.

use moxcms::{CmsError, ColorProfile, Layout, TransformOptions};

use crate::image::zeroed;
use crate::{Error, Image, Result};

/// Converts a picture from the colours of one ICC profile to those of another, relative to the white of each; `None` is sRGB. Alpha stays.
///
/// # Errors
/// `decode-failed` for a profile that is damaged or not of RGB colours, `out-of-memory`.
pub fn convert_colours(image: &mut Image, from: Option<&[u8]>, to: Option<&[u8]>) -> Result<()> {
    if from == to {
        return Ok(());
    }
    let (source, target) = (profile(from)?, profile(to)?);
    let length = from.or(to).map_or(0, <[u8]>::len);
    let transform = source
        .create_transform_8bit(Layout::Rgba, &target, Layout::Rgba, TransformOptions::default())
        .map_err(|error| broken(length, &error))?;
    let width = 4 * image.width();
    let mut converted: Vec<u8> = zeroed(width)?;
    for row in image.data_mut().chunks_exact_mut(width) {
        transform.transform(row, &mut converted).map_err(|error| broken(length, &error))?;
        row.copy_from_slice(&converted);
    }
    Ok(())
}

fn profile(icc: Option<&[u8]>) -> Result<ColorProfile> {
    match icc {
        Some(icc) => ColorProfile::new_from_slice(icc).map_err(|error| broken(icc.len(), &error)),
        None => Ok(ColorProfile::new_srgb()),
    }
}

fn broken(bytes: usize, error: &CmsError) -> Box<Error> {
    Error::DecodeFailed { bytes: bytes as u64, reason: format!("the colour profile is not usable ({error})") }.into()
}
