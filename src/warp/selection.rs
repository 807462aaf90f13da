//! Overlapped pixels (paper, section 3.2.3): of the candidates for a pixel the one that looks most like the reference
//! becomes it (equations 13 and 14), outside the reference the nearest one (equation 15).

use super::candidates::Candidates;
use super::canvas::Canvas;
use super::difference;
use super::render::Output;
use super::sample::{OPAQUE, photometric_error};
use super::scene::Scene;
use super::{RELIABLE, WarpMode};
use crate::image::zeroed;
use crate::{InverseDepth, Result};

/// Share of the photos' mean photometric error that is added to 3σ². Tuned on the evaluation cases.
const USUAL: f64 = 0.19;

/// Decides which candidates become pixels.
pub(super) struct Painter<'a> {
    scene: &'a Scene<'a>,
    pixels: &'a mut [[u8; 4]],
    footprint: &'a mut [u8],
    /// Empty where it is not wanted.
    confidence: &'a mut [u8],
    /// The target's inverse depth of the accepted candidate; empty where it is not needed.
    pub depth: Vec<f32>,
    /// 1/3σ²: σ is the colour distance, plus a share of how much the photos differ all over.
    per_colour: f32,
}

impl<'a> Painter<'a> {
    pub fn new(scene: &'a Scene<'a>, canvas: &Canvas, out: &'a mut Output<'_>) -> Result<Self> {
        let colour = scene.options.colour_distance;
        Ok(Self {
            scene,
            pixels: out.image.pixels_mut(),
            footprint: out.footprint.data_mut(),
            confidence: out.confidence.as_mut().map_or(&mut [], |confidence| confidence.data_mut()),
            depth: zeroed(needed_depth(scene).map_or(0, |_| canvas.width * canvas.height))?,
            per_colour: if colour.is_finite() {
                (1.0 / (3.0 * colour * colour + USUAL * difference::mean(scene))) as f32
            } else {
                0.0
            },
        })
    }

    /// Draws each candidate that is no void and better than what its pixel already shows.
    #[inline(always)]
    pub fn offer(&mut self, candidates: &Candidates) {
        // What the loop reads lies in locals: nothing that it writes could change it.
        let Scene { target, distorted, outside, reference, options, .. } = *self.scene;
        let photo = distorted.map_or(target, |distorted| distorted.photo);
        let soft = options.mode == WarpMode::Soft;
        let select = soft || options.mode == WarpMode::Optimal;
        let (target_depth, always) = (needed_depth(self.scene).map(InverseDepth::data), options.depth || soft);
        let per_colour = self.per_colour;
        let footprint = &mut *self.footprint;
        let pixels = &mut self.pixels[..footprint.len()];
        let depths = &mut self.depth[..];
        let confidences = &mut self.confidence[..];
        for candidate in candidates.iter() {
            let at = candidate.at();
            if candidate.beyond() {
                continue;
            }
            if let Some(outside) = outside {
                let nearest = candidate.tap().nearest;
                if !target.is_there(target.pixels()[nearest]) {
                    // A hole within the target is a void.
                    footprint[at] |= !outside.data()[nearest];
                    continue;
                }
            }
            footprint[at] = 255;
            let there = u32::from_le_bytes(pixels[at]);
            let taken = there >= OPAQUE;
            if candidate.void() || taken && !select {
                continue;
            }
            let tap = candidate.tap();
            let colour = tap.colour(&photo);
            // The reference's pixel, in the overlap.
            let like = reference.pixels().get(candidate.index()).map(|&pixel| u32::from_le_bytes(pixel));
            let mut confidence = 255;
            if let Some(like) = like
                && (per_colour > 0.0 || soft)
            {
                // The void distance is reduced where colours differ: misplaced and unlike is a ghost.
                let apart = photometric_error(like, colour) as f32 * per_colour;
                let strictness = 1.0 + apart * (1.0 + apart / 16.0);
                if soft {
                    confidence = candidate.confidence(strictness);
                } else if !candidate.near(strictness) {
                    continue;
                }
            }
            let depth = target_depth.filter(|_| always || like.is_none());
            let nearness = depth.map(|depth| depth[tap.nearest]);
            if taken {
                // The error of the one already there is computed from its pixel, so that errors need not be stored.
                let reliable = [confidence >= RELIABLE, !soft || confidences[at] >= RELIABLE];
                // Of several that are not, the nearest one hides the others, as outside.
                let worse = match like.filter(|_| reliable[0] || reliable[1]) {
                    Some(like) if reliable[0] == reliable[1] => {
                        photometric_error(like, colour) >= photometric_error(like, there)
                    }
                    Some(_) => reliable[1],
                    None => nearness.is_none_or(|nearness| rank(nearness) <= rank(depths[at])),
                };
                if worse {
                    continue;
                }
            }
            if soft {
                confidences[at] = confidence;
            }
            if let Some(nearness) = nearness {
                depths[at] = nearness;
            }
            pixels[at] = colour.to_le_bytes();
        }
    }
}

/// What is nearer has a higher rank; what is not known, the lowest.
#[inline(always)]
fn rank(nearness: f32) -> f32 {
    if nearness.is_nan() { f32::NEG_INFINITY } else { nearness }
}

/// The target's depth map, if anything reads it: the selection outside the reference, or the caller.
fn needed_depth<'a>(scene: &Scene<'a>) -> Option<&'a InverseDepth> {
    scene
        .target_depth
        .filter(|_| scene.options.depth || matches!(scene.options.mode, WarpMode::Optimal | WarpMode::Soft))
}
