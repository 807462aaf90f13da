//! Local alignment across the seam.
//!
//! What displacement is left between the photos shows where lines cross the seam. The target gives way there, by a smooth field that
//! fades with the distance from the seam, so that what joins does so without a bend (after K. Lin et al., *SEAGULL: Seam-guided
//! Local Alignment for Parallax-tolerant Image Stitching*, ECCV 2016). The field is the optical flow of B. Horn and B. Schunck,
//! *Determining Optical Flow*, Artif. Intell. 17 (1981), weighted by the distance from the seam, from coarse to fine. Straight edges that both
//! photos have at the seam are brought together besides.

mod edges;
mod field;
mod level;
mod resample;

use super::canvas::Placed;
use super::seam::bounds;
use crate::observer::{Observer, Portion};
use crate::rect::diagonal;
use crate::{Image, Mask, Result};
use field::{COMPARED, FARTHEST, Field};
use level::Level;

/// Nodes along the diagonal of the reference, about: 700 align no better.
const NODES: f64 = 350.0;
/// Nodes at most where straight edges are looked for: with fewer, cables of two pixels are lost in photos of 2 MP.
pub(crate) const EDGE_NODES: usize = 2_000_000;
/// Levels of resolution, each half the one before.
const LEVELS: usize = 3;

/// The side in pixels of the grid's squares, by the size of the reference.
pub(crate) fn node_side(reference: (usize, usize)) -> usize {
    ((diagonal(reference) / NODES) as usize).max(1)
}

/// Moves the target in `image` so that it meets the reference along the `seam`.
pub(super) fn align(image: &mut Image, reference: &Placed<'_>, seam: &Mask, observer: &mut dyn Observer) -> Result<()> {
    let length = diagonal(reference.photo.size());
    let Some(bounds) = bounds(seam) else { return Ok(()) };
    let around = |reach: f32| bounds.grown((f64::from(reach) * length) as usize, seam.size()).ranges();
    let (near, region) = (around(edges::REACH), around(FARTHEST));
    let finest = |region, reach, side| Level::finest(image, reference, seam, region, reach, side, length);
    let squared = (near.0.len() * near.1.len()) as f64 / EDGE_NODES as f64;
    let side = (squared.sqrt().ceil() as usize).max(1);
    let crossings = edges::crossings(&finest(&near, edges::REACH, side)?, length)?;
    let side = node_side(reference.photo.size());
    // Twice as far, as what is displaced is compared.
    let first = finest(&region, 2.0 * COMPARED, side)?;
    let mut levels = vec![first];
    while let Some(coarser) = levels.last().filter(|_| levels.len() < LEVELS).map(Level::halved) {
        levels.push(coarser?);
    }
    let mut field: Option<Field> = None;
    let total = levels.len() as f32;
    while let Some(level) = levels.pop() {
        let from = 0.5 * (1.0 - (levels.len() + 1) as f32 / total);
        let mut solving = Portion::new(observer, from, from + 0.5 / total);
        let edges = edges::equations(&crossings, &level, length)?;
        field = Some(Field::of(&level, &edges, field.as_ref(), &mut solving)?);
    }
    match field {
        Some(field) => resample::displace(image, &region, (&field, side), &mut Portion::new(observer, 0.5, 1.0)),
        None => Ok(()),
    }
}
