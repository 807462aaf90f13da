//! From one colour space to another.
//!
//! Profiles of cameras and screens are a curve for each of red, green and blue, and a matrix to the connection space (ICC.1:2022, annex
//! F.3). moxcms reads them; its transforms for all other kinds would be half of the wasm module, so that these are applied here.

use moxcms::{CmsError, ColorProfile, ToneReprCurve};

use crate::image::reserve;
use crate::{Error, Image, Result};

/// Entries of the table from light to levels: in the dark, where the curve is steepest, five to a level.
const STEPS: usize = 1 << 14;

/// Converts a picture from the colours of one ICC profile to those of another, relative to the white of each; `None` is sRGB. Alpha stays;
/// what the other space has no colour for is clipped.
///
/// # Errors
/// `decode-failed` for a profile that is damaged, or not made of curves and a matrix, `out-of-memory`.
pub fn convert_colours(image: &mut Image, from: Option<&[u8]>, to: Option<&[u8]>) -> Result<()> {
    if from == to {
        return Ok(());
    }
    let (source, target) = (Space::new(from)?, Space::new(to)?);
    let (light, levels) = (source.light()?, target.levels()?);
    let matrix =
        source.profile.transform_matrix(&target.profile).v.map(|row| row.map(|v| (v * (STEPS - 1) as f64) as f32));
    for pixel in image.pixels_mut() {
        let [r, g, b, _] = *pixel;
        let [r, g, b] = [light[0][usize::from(r)], light[1][usize::from(g)], light[2][usize::from(b)]];
        for ((out, row), levels) in pixel.iter_mut().zip(&matrix).zip(&levels) {
            // The conversion saturates.
            let step = (row[0] * r + row[1] * g + row[2] * b + 0.5) as usize;
            *out = levels[step.min(STEPS - 1)];
        }
    }
    Ok(())
}

/// A colour space of curves and a matrix.
struct Space {
    profile: ColorProfile,
    curves: [ToneReprCurve; 3],
    /// Bytes of the file, for errors.
    bytes: usize,
}

impl Space {
    fn new(icc: Option<&[u8]>) -> Result<Self> {
        let bytes = icc.map_or(0, <[u8]>::len);
        let profile = match icc {
            Some(icc) => ColorProfile::new_from_slice(icc).map_err(|error| broken(bytes, &error))?,
            None => ColorProfile::new_srgb(),
        };
        let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc].map(Clone::clone);
        let volume = profile.profile_volume().unwrap_or(0.0);
        let ([Some(red), Some(green), Some(blue)], true) = (curves, volume.abs() > 1e-6) else {
            return Err(unusable(bytes, "it has no curves and matrix"));
        };
        Ok(Self { profile, curves: [red, green, blue], bytes })
    }

    /// Linear light of every level of red, green and blue.
    fn light(&self) -> Result<[[f32; 256]; 3]> {
        let mut light = [[0.0; 256]; 3];
        for (light, curve) in light.iter_mut().zip(&self.curves) {
            let curve = curve.make_linear_evaluator().map_err(|error| broken(self.bytes, &error))?;
            for (level, light) in light.iter_mut().enumerate() {
                *light = curve.evaluate_value(level as f32 / 255.0);
            }
        }
        Ok(light)
    }

    /// The levels of linear light k / ([`STEPS`] − 1).
    fn levels(&self) -> Result<[Vec<u8>; 3]> {
        let mut levels = [Vec::new(), Vec::new(), Vec::new()];
        for (levels, curve) in levels.iter_mut().zip(&self.curves) {
            let curve = curve.make_gamma_evaluator().map_err(|error| broken(self.bytes, &error))?;
            reserve(levels, STEPS)?;
            let level = |k: usize| (255.0 * curve.evaluate_value(k as f32 / (STEPS - 1) as f32) + 0.5) as u8;
            levels.extend((0..STEPS).map(level));
        }
        Ok(levels)
    }
}

fn broken(bytes: usize, error: &CmsError) -> Box<Error> {
    unusable(bytes, &error.to_string())
}

fn unusable(bytes: usize, reason: &str) -> Box<Error> {
    Error::DecodeFailed { bytes: bytes as u64, reason: format!("the colour profile is not usable ({reason})") }.into()
}
