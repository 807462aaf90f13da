//! Inverse depth on the mosaic's canvas, which guides the filling.

use super::seam::REFERENCE;
use crate::geometry::Model;
use crate::image::{check_size, reserve};
use crate::line_fit::LineFit;
use crate::rect::Rect;
use crate::warp::Warped;
use crate::{InverseDepth, Mask, Result, View};

/// Samples taken along the longer side of the reference.
const SAMPLES: usize = 128;
/// Reweighted least squares settles within a few rounds.
const ROUNDS: usize = 12;
/// Fewer samples determine no gauge.
const LEAST: usize = 16;

/// Tells the background of a void from the foreground object whose parallax opened it.
#[derive(Debug, Clone, PartialEq)]
pub struct FillGuide {
    /// Inverse depth of what the mosaic shows, NaN where it is not known.
    pub depth: InverseDepth,
    /// Epipole on the canvas, homogeneous: parallax is along the lines through it. All zero if unknown.
    pub epipole: [f64; 3],
}

impl FillGuide {
    /// The guide for a mosaic of `warped`, which `forward` has made, and `reference`; `None` without parallax. Takes the depth out of
    /// `warped`, as it is as large as the mosaic.
    ///
    /// Where the mosaic shows the reference by its `seam`, and where the target has no depth, it is the reference's, brought into the
    /// same gauge by the affine change that fits best where both are known, by least absolute deviations: robust where the two
    /// photos show different surfaces.
    ///
    /// # Errors
    /// `size-mismatch` when the reference or the seam does not fit the canvas, or footprint, confidence or a depth is not of the size
    /// of its picture; `out-of-memory`.
    pub fn new(warped: &mut Warped, seam: &Mask, forward: &Model, reference: View<'_>) -> Result<Option<Self>> {
        warped.check_canvas(reference.image)?;
        check_size("seam", seam.size(), warped.image.size())?;
        let Some(depth) = warped.depth.take() else { return Ok(None) };
        let (width, height) = depth.size();
        let mut data = depth.into_values();
        if let Some(other) = reference.depth {
            let size = reference.image.size();
            check_size("referenceDepth", other.size(), size)?;
            let first = warped.offset.1 * width + warped.offset.0;
            let samples = samples(&data[first..], width, other)?;
            if samples.len() >= LEAST {
                let [slope, shift] = line(&samples);
                let rows = data[first..].chunks_mut(width).zip(seam.data()[first..].chunks(width));
                for ((row, labels), other) in rows.zip(other.data().chunks_exact(size.0)) {
                    for ((d, &label), &other) in row.iter_mut().zip(labels).zip(other) {
                        if d.is_nan() || label == REFERENCE {
                            *d = (slope * f64::from(other) + shift) as f32;
                        }
                    }
                }
            }
        }
        let e = &forward.e;
        let (left, top) = (warped.offset.0 as f64, warped.offset.1 as f64);
        let epipole = [e[0] + left * e[2], e[1] + top * e[2], e[2]];
        Ok(Some(Self { depth: InverseDepth::from_values(data, width, height), epipole }))
    }

    /// The epipole in a window of the canvas.
    pub(super) fn epipole_from(&self, window: Rect) -> [f64; 3] {
        let [x, y, w] = self.epipole;
        [x - window.x as f64 * w, y - window.y as f64 * w, w]
    }
}

/// The reference's inverse depth and the target's, on a grid of places that both know. `canvas` begins at the
/// reference's first pixel.
fn samples(canvas: &[f32], stride: usize, reference: &InverseDepth) -> Result<Vec<[f64; 2]>> {
    let (width, height) = reference.size();
    let step = width.max(height).div_ceil(SAMPLES);
    let mut samples = Vec::new();
    reserve(&mut samples, SAMPLES * SAMPLES)?;
    for y in (0..height).step_by(step) {
        for x in (0..width).step_by(step) {
            let pair = [reference.data()[y * width + x], canvas[y * stride + x]];
            if pair.iter().all(|d| d.is_finite()) {
                samples.push(pair.map(f64::from));
            }
        }
    }
    Ok(samples)
}

/// Slope and intercept of the line y = a·x + b of least absolute deviation, by iteratively reweighted least squares.
fn line(samples: &[[f64; 2]]) -> [f64; 2] {
    let mut found = [0.0; 2];
    let mut scale = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (mut fit, mut deviation) = (LineFit::default(), 0.0);
        // A residual counts by its size, not its square; nearly none at all is no reason to count without bounds.
        for &[u, v] in samples {
            let off = (v - found[0] * u - found[1]).abs();
            deviation += off;
            fit.add(u, v, if scale.is_finite() { 1.0 / off.max(scale) } else { 1.0 });
        }
        if deviation == 0.0 {
            break; // exact
        }
        let Some(better) = fit.line() else {
            return [0.0, fit.constant()]; // all of one depth
        };
        found = better;
        scale = 1e-3 * deviation / samples.len() as f64;
    }
    found
}
