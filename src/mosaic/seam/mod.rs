//! Which photo shows where both are valid.
//!
//! A minimum cut between the places where only the target is valid and those where only the reference is, after V.
//! Kwatra et al., *Graphcut Textures*, SIGGRAPH 2003: it runs where the photos agree in colour and gradient. It is found on
//! a coarse grid and refined within a narrow band at twice the resolution, again and again.

mod cost;
mod flow;
mod islands;
mod level;

use super::canvas::Placed;
use super::span::Span;
use crate::distance::{distance, to_outside};
use crate::{Image, Mask, Result};
use level::Level;

/// Labels of a seam mask.
const NONE: u8 = 0;
const TARGET: u8 = 1;
const REFERENCE: u8 = 2;
const BOTH: u8 = 3;

/// Cells of the coarsest grid, at most.
const COARSEST: usize = 6000;

/// Which photos are valid: 0 none, 1 the target, 2 the reference, 3 both.
pub(super) fn sides(image: &Image, reference: &Placed<'_>) -> Result<Mask> {
    let mut mask = Mask::empty(image.width(), image.height())?;
    let pixels = image.pixels().chunks_exact(image.width());
    for (y, (row, pixels)) in mask.data_mut().chunks_exact_mut(image.width()).zip(pixels).enumerate() {
        row.iter_mut().zip(pixels).for_each(|(side, pixel)| *side = if pixel[3] != 0 { TARGET } else { NONE });
        if let Some(photo) = reference.row(y) {
            let over = row[reference.left..].iter_mut().zip(photo);
            over.for_each(|(side, &pixel)| *side |= if reference.is_valid(pixel) { REFERENCE } else { NONE });
        }
    }
    Ok(mask)
}

/// Gives every pixel that both photos cover to the one whose border is farther away; the reference's if they are alike.
pub(super) fn middle(image: &Image, reference: &Placed<'_>, seam: &mut Mask) -> Result<()> {
    let (width, height) = (image.width(), image.height());
    let inside = distance(seam.data().len(), width, &|i| seam.data()[i] & TARGET == 0)?;
    let size = (reference.photo.width(), reference.photo.height());
    let own = if reference.masked {
        Some(distance(seam.data().len(), width, &|i| seam.data()[i] & REFERENCE == 0)?)
    } else {
        None
    };
    for (i, side) in seam.data_mut().iter_mut().enumerate().filter(|(_, side)| **side == BOTH) {
        let (x, y) = (i % width, i / width);
        let edge = to_outside((x - reference.left, y - reference.top), size);
        let edge = own.as_ref().map_or(edge, |own| edge.min(own[i].into()));
        *side = if u32::from(inside[i]).min(to_outside((x, y), (width, height))) > edge { TARGET } else { REFERENCE };
    }
    Ok(())
}

/// Where the alignment may be wrong.
pub(super) struct Doubt<'a> {
    /// On the reference's grid, where it is reliable.
    pub reliable: Option<&'a Mask>,
    /// Of the warped target's pixels: see [`crate::warp::Warped`].
    pub confidence: Option<&'a Mask>,
}

/// Decides by a minimum cut for every pixel that both photos cover.
pub(super) fn cut(
    image: &Image,
    reference: &Placed<'_>,
    doubt: &Doubt<'_>,
    seam: &mut Mask,
    span: &mut Span<'_>,
) -> Result<()> {
    let Some(finest) = cost::finest(image, reference, doubt, seam, &mut span.part(0.0, 0.5))? else {
        return Ok(());
    };
    let mut levels = vec![finest];
    while let Some(coarser) = levels.last().filter(|level| level.free() > COARSEST).map(Level::halved) {
        levels.push(coarser?);
    }
    let mut coarser: Option<Level> = None;
    let coarsest = levels.len();
    let Some(borders) = levels.last().map(Level::borders).transpose()? else { return Ok(()) };
    while let Some(mut level) = levels.pop() {
        span.part(0.5 + 0.5 / (levels.len() + 1) as f32, 1.0).row(0, 1)?;
        level.cut(coarser.as_ref(), &borders, (coarsest - levels.len() - 1) as u32)?;
        coarser = Some(level);
    }
    if let Some(mut level) = coarser {
        level.merge_islands()?;
        level.write(seam);
    }
    Ok(())
}
