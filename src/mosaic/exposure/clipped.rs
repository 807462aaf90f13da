//! What is clipped in the target: nobody knows how bright it was, or what colour. A gain below 1 would make white gray.

use wide::f32x4;

use super::fit::{Field, Node};
use crate::image::zeroed;
use crate::srgb::USABLE;
use crate::{Image, Result};

/// Pixels looked at, about, from node to node; and the share of those around a node that is much. Less is glints.
const TAPS: usize = 16;
const MUCH: f32 = 0.125;
/// Light from which what is near clipped pixels goes over into white, and where it is white. Wide, as otherwise gravel and clouds show
/// the contrast between their gain and that of white.
const FROM: f32 = 0.45;
const TO: f32 = 0.95;

/// Notes in the field how much of the target is clipped around each node.
pub(super) fn mark(field: &mut Field, target: &Image) -> Result<()> {
    let Field { nodes, columns, step, .. } = field;
    let stride = (*step / TAPS).max(1);
    let mut counts: Vec<f32> = zeroed(nodes.len())?;
    for (y, row) in target.pixels().chunks_exact(target.width()).enumerate().step_by(stride) {
        for (x, pixel) in row.iter().enumerate().step_by(stride).filter(|(_, pixel)| pixel[3] != 0) {
            let node = (y + *step / 2) / *step * *columns + (x + *step / 2) / *step;
            counts[node] += 1.0;
            nodes[node].gain[3] += f32::from(pixel[..3].iter().all(|level| *level > USABLE[1]));
        }
    }
    for (Node { gain, .. }, count) in nodes.iter_mut().zip(counts) {
        gain[3] = (gain[3] / (MUCH * count).max(1.0)).min(1.0);
    }
    Ok(())
}

/// How far light has gone over into white, 0 to 1.
#[inline]
pub(super) fn whiteness(light: f32x4) -> f32 {
    let [red, green, blue, _] = light.to_array();
    let luma = 0.25 * (red + 2.0 * green + blue);
    let above = ((luma - FROM) / (TO - FROM)).clamp(0.0, 1.0);
    above * above
}

/// What has become of a pixel's light, with the channels that were clipped in it no darker than both others: darkening red, of which there was more than
/// the pixel says, would turn a white wall cyan.
#[inline]
pub(super) fn untinted(light: f32x4, pixel: &[u8; 4]) -> f32x4 {
    if pixel[..3].iter().all(|level| *level <= USABLE[1]) {
        return light;
    }
    let mut channels = light.to_array();
    let [r, g, b, _] = channels;
    for ((own, least), level) in channels.iter_mut().zip([g.min(b), r.min(b), r.min(g)]).zip(pixel) {
        let clipped = f32::from(level.saturating_sub(USABLE[1])) / f32::from(255 - USABLE[1]);
        *own += (least.max(*own) - *own) * clipped;
    }
    f32x4::new(channels)
}
