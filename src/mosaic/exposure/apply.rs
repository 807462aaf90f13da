//! Multiplying light.

use super::fit::{Curve, Field, Response};
use super::tone::{STEPS, levels};
use crate::image::zeroed;
use crate::mosaic::span::Span;
use crate::{Image, Result};

/// Multiplies the linear light of every pixel by the gain at its place.
pub(super) fn apply(image: &mut Image, response: &Response, linear: &[f32; 256], span: &mut Span<'_>) -> Result<()> {
    let levels = levels(linear)?;
    // So that a product is an index.
    let scaled = response.curves.map(|Curve { slope, pivot }| {
        linear.map(|light| {
            let light = f64::from(light);
            let bent = if light > 0.0 { light * libm::exp(slope * (libm::log(light) - pivot)) } else { 0.0 };
            (bent * (STEPS - 1) as f64) as f32
        })
    });
    let (width, height, field) = (image.width, image.height, &response.field);
    let mut row: Vec<[f32; 4]> = zeroed(field.columns)?;
    for (y, pixels) in image.data.chunks_exact_mut(4 * width).enumerate() {
        span.row(y, height)?;
        field.row(y, &mut row);
        for (i, pixels) in pixels.as_chunks_mut::<4>().0.chunks_mut(field.step).enumerate() {
            let gain = row[i.min(field.columns - 1)];
            let next = row[(i + 1).min(field.columns - 1)];
            let slope: [f32; 3] = std::array::from_fn(|c| (next[c] - gain[c]) / field.step as f32);
            for (x, pixel) in pixels.iter_mut().enumerate().filter(|(_, pixel)| pixel[3] != 0) {
                for c in 0..3 {
                    let light = scaled[c][usize::from(pixel[c])] * (gain[c] + slope[c] * x as f32) + 0.5;
                    pixel[c] = levels[(light as usize).min(STEPS - 1)];
                }
            }
        }
    }
    Ok(())
}

impl Field {
    /// The nodes' columns at row `y` of the canvas.
    fn row(&self, y: usize, out: &mut [[f32; 4]]) {
        let above = (y / self.step).min(self.rows - 1);
        let below = (above + 1).min(self.rows - 1);
        let share = (y - above * self.step) as f32 / self.step as f32;
        let share = if below == above { 0.0 } else { share };
        for (i, out) in out.iter_mut().enumerate() {
            let (above, below) = (self.nodes[above * self.columns + i], self.nodes[below * self.columns + i]);
            *out = std::array::from_fn(|c| above[c] + (below[c] - above[c]) * share);
        }
    }
}
