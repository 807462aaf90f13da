//! Local alignment across the seam.
//!
//! What displacement is left between the photos shows where lines cross the seam. The target gives way there, by a smooth field that
//! fades with the distance from the seam, so that what joins does so without a bend (after K. Lin et al., *SEAGULL: Seam-guided
//! Local Alignment for Parallax-tolerant Image Stitching*, ECCV 2016). The field is the optical flow of B. Horn and B. Schunck,
//! *Determining Optical Flow*, Artif. Intell. 17 (1981), weighted by the distance from the seam, from coarse to fine.

mod field;
mod level;
mod resample;

use super::canvas::Placed;
use super::multiband::surroundings;
use crate::observer::{Observer, Portion};
use crate::rect::diagonal;
use crate::{Image, Mask, Result};
use field::{FARTHEST, Field};
use level::Level;

/// Nodes along the diagonal of the reference, about: 700 align no better.
const NODES: f64 = 350.0;
/// Levels of resolution, each half the one before.
const LEVELS: usize = 3;

/// Moves the target in `image` so that it meets the reference along the `seam`.
pub(super) fn align(image: &mut Image, reference: &Placed<'_>, seam: &Mask, observer: &mut dyn Observer) -> Result<()> {
    let length = diagonal(reference.photo.size());
    let Some(region) = surroundings(seam, (f64::from(FARTHEST) * length) as usize) else { return Ok(()) };
    let side = ((length / NODES) as usize).max(1);
    let mut levels = vec![Level::finest(image, reference, seam, &region, side, length / side as f64)?];
    while let Some(coarser) = levels.last().filter(|_| levels.len() < LEVELS).map(Level::halved) {
        levels.push(coarser?);
    }
    let mut field: Option<Field> = None;
    let total = levels.len() as f32;
    while let Some(level) = levels.pop() {
        let from = 0.5 * (1.0 - (levels.len() + 1) as f32 / total);
        let mut solving = Portion::new(observer, from, from + 0.5 / total);
        field = Some(Field::of(&level, field.as_ref(), &mut solving)?);
    }
    match field {
        Some(field) => resample::displace(image, &region, (&field, side), &mut Portion::new(observer, 0.5, 1.0)),
        None => Ok(()),
    }
}
