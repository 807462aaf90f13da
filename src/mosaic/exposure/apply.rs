//! Multiplying light.

use wide::{CmpGt, f32x4, i32x4};

use super::clipped::{untinted, whiteness};
use super::fit::{Curve, ExposureModel, Field};
use super::tone::{STEPS, levels};
use crate::observer::{Observer, report_row};
use crate::{Image, Rect, Result, Stage};

/// Where highlights are kept, what they are compressed from.
const KNEE: f32 = 0.7;
/// Nodes from the frame to where they are kept in full.
const FADE: f32 = 3.0;

/// Multiplies the linear light of every pixel by the gain at its place. To keep highlights, what is brightened beyond the knee is
/// compressed so that white becomes white (Reinhard et al., *Photographic Tone Reproduction for Digital Images*, 2002, equation 4):
/// outside of the `frame`, more and more as the distance from it grows, or everywhere. Clipped pixels are not darkened, and bright ones near
/// them less; where single channels are clipped, they do not tint the pixel.
pub(super) fn apply(
    image: &mut Image,
    response: &ExposureModel,
    frame: Option<Rect>,
    linear: &[f32; 256],
    observer: &mut dyn Observer,
) -> Result<()> {
    let levels = levels(linear)?;
    // So that a product is an index.
    let mut scaled = [[0.0; 3]; 256];
    for (scaled, &light) in scaled.iter_mut().zip(linear).filter(|(_, light)| **light > 0.0) {
        let light = f64::from(light);
        for (scaled, Curve { slope, pivot }) in scaled.iter_mut().zip(response.curves) {
            let bent = light * libm::exp(slope * (libm::log(light) - pivot));
            *scaled = (bent * (STEPS - 1) as f64) as f32;
        }
    }
    let white = f32x4::new([scaled[255][0], scaled[255][1], scaled[255][2], 0.0]);
    let most = f32x4::splat((STEPS - 1) as f32);
    let knee = f32x4::splat(KNEE) * most;
    let (width, height) = image.size();
    let Field { nodes, columns, rows, step } = &response.field;
    let share_of = 1.0 / *step as f32;
    for (y, pixels) in image.pixels_mut().chunks_exact_mut(width).enumerate() {
        report_row(observer, Stage::Blend, y, height)?;
        let above = y / step;
        let (above, below) = (above * columns, (above + 1).min(rows - 1) * columns);
        let share = f32x4::splat((y % step) as f32 * share_of);
        let outside = frame.map(|Rect { x, y: top, width, height }| ([x, x + width], distance(y, [top, top + height])));
        let gain_at = |i: usize| {
            let [above, below] = [above + i, below + i].map(|node| f32x4::new(nodes[node].gain));
            above + (below - above) * share
        };
        for (i, pixels) in pixels.chunks_mut(*step).enumerate() {
            let gain = gain_at(i);
            let slope = (gain_at((i + 1).min(columns - 1)) - gain) * f32x4::splat(share_of);
            for (x, pixel) in pixels.iter_mut().enumerate().filter(|(_, pixel)| pixel[3] != 0) {
                let gain = gain + slope * f32x4::splat(x as f32);
                let light = |c: usize| scaled[usize::from(pixel[c])][c];
                let mut light = f32x4::new([light(0), light(1), light(2), 0.0]) * gain;
                if light.cmp_gt(knee).any() {
                    let kept = outside.map_or(1.0, |(sides, vertical)| {
                        (distance(i * step + x, sides).max(vertical) as f32 * share_of / FADE).min(1.0)
                    });
                    if kept > 0.0 {
                        let bent = compressed(light, white * gain);
                        light = light.min(most);
                        light += (bent - light) * f32x4::splat(kept);
                    }
                }
                let [.., clipped] = gain.to_array();
                if clipped > 0.0 {
                    let light_of = |c: usize| linear[usize::from(pixel[c])];
                    let before = f32x4::new([light_of(0), light_of(1), light_of(2), 0.0]);
                    let share = f32x4::splat(clipped * whiteness(before));
                    light += ((before * most).max(light) - light) * share;
                }
                light = untinted(light, pixel);
                let light = light + f32x4::splat(0.5);
                let steps = light.fast_trunc_int().min(i32x4::splat(STEPS as i32 - 1)).to_array();
                pixel.iter_mut().zip(&steps[..3]).for_each(|(own, &step)| *own = levels[step as usize]);
            }
        }
    }
    Ok(())
}

/// How far a coordinate is from a range.
#[inline]
fn distance(at: usize, [from, to]: [usize; 2]) -> usize {
    from.saturating_sub(at).max(at.saturating_sub(to))
}

/// Light that is multiplied, in table steps, given what white becomes.
#[inline]
fn compressed(light: f32x4, white: f32x4) -> f32x4 {
    let most = f32x4::splat((STEPS - 1) as f32);
    let (one, knee, rest) = (f32x4::splat(1.0), f32x4::splat(KNEE) * most, f32x4::splat(1.0 - KNEE) * most);
    let above = (light - knee) / rest;
    // Slope 1 at the knee, 1 at white.
    let end = (white - knee) / rest;
    let bent = knee + rest * above * (one + above / (end * end)) / (one + above);
    (light.cmp_gt(knee) & white.cmp_gt(most)).blend(bent, light)
}
