//! Straight line segments of a photo.
//!
//! R. Grompone von Gioi, J. Jakubowicz, J.-M. Morel and G. Randall, *LSD: a Line Segment Detector*, IPOL 2 (2012): pixels
//! whose level lines point the same way are grown into regions, each is approximated by a rectangle, and a rectangle is
//! accepted when noise alone would hardly ever produce as many aligned pixels (an a-contrario test).

mod collinear;
mod level_lines;
mod rectangle;
mod region;

pub(crate) use collinear::join_collinear;
use level_lines::LevelLines;
use rectangle::Validation;
use region::Grower;

use crate::{Error, ImageView, Result};

/// A straight edge. Seen from `start` to `end`, the darker side lies to the right (x right, y down).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSegment {
    /// One end, in pixels of the photo.
    pub start: [f64; 2],
    /// The other end, in pixels of the photo.
    pub end: [f64; 2],
    /// Width of the edge in pixels: that of the rectangle which holds the aligned pixels.
    pub width: f64,
    /// −log₁₀ of the number of false alarms: how many such segments are expected in a photo of noise.
    pub significance: f64,
}

impl LineSegment {
    /// In pixels.
    pub fn length(&self) -> f64 {
        let [x, y] = [0, 1].map(|k| self.end[k] - self.start[k]);
        (x * x + y * y).sqrt()
    }
}

/// Options of [`line_segments`]. The defaults are the paper's.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSegmentOptions {
    /// Size at which lines are looked for, relative to the photo's; a reduction removes staircases and compression blocks.
    pub scale: f64,
    /// Deviation of the Gaussian before the reduction, in pixels of the reduced photo.
    pub sigma_scale: f64,
    /// Bound of the error of a gray level. Weaker gradients, whose direction it could turn by the tolerance, are left out.
    pub quantization_error: f64,
    /// How far the directions within a region may differ from the region's, in degrees.
    pub angle_tolerance: f64,
    /// Least share of a rectangle's area that its region must fill.
    pub min_density: f64,
    /// Least −log₁₀ of the number of false alarms.
    pub min_significance: f64,
    /// Least length in pixels of the photo.
    pub min_length: f64,
}

impl Default for LineSegmentOptions {
    fn default() -> Self {
        Self {
            scale: 0.8,
            sigma_scale: 0.6,
            quantization_error: 2.0,
            angle_tolerance: 22.5,
            min_density: 0.7,
            min_significance: 0.0,
            min_length: 0.0,
        }
    }
}

/// Finds the straight line segments of a photo, strongest gradient first.
///
/// # Errors
/// `invalid-argument` for options out of range, `out-of-memory`.
pub fn line_segments(image: ImageView<'_>, options: &LineSegmentOptions) -> Result<Vec<LineSegment>> {
    check(options)?;
    let tolerance = options.angle_tolerance.to_radians();
    let cosine = libm::cos(tolerance);
    let sine = (1.0 - cosine * cosine).sqrt();
    let lines = LevelLines::new(image, options, options.quantization_error / sine)?;
    let validation = Validation::new(&lines, options.angle_tolerance / 180.0, options.min_significance);
    let mut grower = Grower::new(&lines, tolerance, options.min_density)?;
    let mut segments = Vec::new();
    for seed in lines.by_strength()? {
        let Some(rectangle) = grower.rectangle(seed, validation.least_pixels()) else { continue };
        if rectangle.length() < options.min_length * options.scale {
            continue;
        }
        let Some((rectangle, significance)) = validation.validate(rectangle) else { continue };
        // A gradient belongs to the middle of the four pixels that it was computed from.
        let place = |[x, y]: [f64; 2]| [x, y].map(|v| (v + 1.0) / options.scale - 0.5);
        segments.push(LineSegment {
            start: place(rectangle.start),
            end: place(rectangle.end),
            width: rectangle.width / options.scale,
            significance,
        });
    }
    Ok(segments)
}

fn check(options: &LineSegmentOptions) -> Result<()> {
    let ranges = [
        ("scale", options.scale, 0.1, 1.0, "from 0.1 to 1"),
        ("sigmaScale", options.sigma_scale, 0.1, 2.0, "from 0.1 to 2"),
        ("quantizationError", options.quantization_error, 0.0, 255.0, "from 0 to 255"),
        ("angleTolerance", options.angle_tolerance, 1.0, 60.0, "from 1 to 60"),
        ("minDensity", options.min_density, 0.0, 1.0, "from 0 to 1"),
        ("minLength", options.min_length, 0.0, 1e6, "from 0 to 1000000"),
        ("minSignificance", options.min_significance, -1e6, 1e6, "from -1000000 to 1000000"),
    ];
    for (name, value, least, most, expected) in ranges {
        if !(least..=most).contains(&value) {
            return Err(Error::InvalidArgument { name, expected, value }.into());
        }
    }
    Ok(())
}
