//! Which photo shows where both are valid.
//!
//! A minimum cut between the places where only the target is valid and those where only the reference is, after V.
//! Kwatra et al., *Graphcut Textures*, SIGGRAPH 2003: it runs where the photos agree in colour and gradient. It is found on
//! a coarse grid and refined within a narrow band at twice the resolution, again and again.

mod cost;
mod detail;
mod extra_costs;
mod flow;
mod islands;
mod level;

use super::blend::SeamGuide;
use super::canvas::Placed;
use crate::distance::{distance, to_outside};
use crate::image::reserve;
use crate::observer::{Observer, Portion, report};
use crate::rect::{bounding_box, extent};
use crate::{Image, Mask, Rect, Result, Stage};
use extra_costs::ExtraCosts;
use level::Level;

/// Labels of a seam mask.
pub(super) const NONE: u8 = 0;
pub(super) const TARGET: u8 = 1;
pub(super) const REFERENCE: u8 = 2;
pub(super) const BOTH: u8 = 3;

/// Cells of the coarsest grid, at most. Between 3000 and 12000 visible steps change by 4 %, the seam's length by 1 %.
const COARSEST: usize = 6000;

/// Whether the seam passes between two neighbours with these labels: no others differ in both bits.
#[inline]
pub(super) fn passes_between(a: u8, b: u8) -> bool {
    a ^ b == TARGET ^ REFERENCE
}

/// The smallest rectangle around all places where the two photos meet; `None` where they do not.
pub(super) fn bounds(seam: &Mask) -> Option<Rect> {
    let (width, height) = seam.size();
    let meetings = |y: usize| {
        let row = &seam.data()[y * width..(y + 1) * width];
        let below = seam.data().get((y + 1) * width..(y + 2) * width).unwrap_or(row);
        extent(row.iter().zip(below).enumerate().map(|(x, (&here, &below))| {
            passes_between(here, below) || row.get(x + 1).is_some_and(|&right| passes_between(here, right))
        }))
    };
    bounding_box(height, &meetings)
}

/// Which photos are valid.
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

/// Gives every pixel that both photos cover to the one whose border is farther away; the reference's if both are equally far.
pub(super) fn middle(image: &Image, reference: &Placed<'_>, seam: &mut Mask) -> Result<()> {
    let (width, height) = image.size();
    let inside = distance(seam.data().len(), width, &|i| seam.data()[i] & TARGET == 0)?;
    let own = reference.border_distance((width, height))?;
    for (i, side) in seam.data_mut().iter_mut().enumerate().filter(|(_, side)| **side == BOTH) {
        let at = (i % width, i / width);
        let edge = u32::from(inside[i]).min(to_outside(at, (width, height)));
        *side = if edge > own.at(at) { TARGET } else { REFERENCE };
    }
    Ok(())
}

/// A cell of a [`predict`]ed seam.
#[derive(Clone, Copy)]
pub(crate) enum Choice {
    /// Only the target is valid.
    Target,
    /// Only the reference is.
    Reference,
    /// Both are, and differ by so many levels, summed over three channels.
    Both(f32),
}

/// Whether the target would show in the cells of a grid of this width: a seam of one resolution, for a prediction.
pub(crate) fn predict(choices: &[Choice], width: usize) -> Result<Vec<bool>> {
    if choices.is_empty() {
        return Ok(Vec::new());
    }
    let mut level = Level::empty(0, 0, width, choices.len() / width.max(1))?;
    for (cell, choice) in level.cells.iter_mut().zip(choices) {
        (cell.side, cell.cost) = match *choice {
            Choice::Target => (TARGET, 0),
            Choice::Reference => (REFERENCE, 0),
            Choice::Both(apart) => (BOTH, cost::seam_cost(apart as i32, 0)),
        };
    }
    let extra = ExtraCosts::near_borders(&level)?;
    level.cut(None, &extra)?;
    let mut target = Vec::new();
    reserve(&mut target, choices.len())?;
    target.extend(level.cells.iter().map(|cell| cell.shown == TARGET));
    Ok(target)
}

/// What decides besides how alike the photos are.
pub(super) struct Preference<'a> {
    pub guide: SeamGuide<'a>,
    /// Of the warped target's pixels: see [`crate::warp::Warped`].
    pub confidence: Option<&'a Mask>,
    /// Which photo shows in the reference, if that is a mosaic itself: the sharper one is preferred; and which of them is not distorted.
    pub labels: Option<(&'a Mask, u8)>,
}

/// Decides by a minimum cut for every pixel that both photos cover.
pub(super) fn cut(
    image: &Image,
    reference: &Placed<'_>,
    preference: &Preference<'_>,
    seam: &mut Mask,
    observer: &mut dyn Observer,
) -> Result<()> {
    let Some(finest) = cost::finest(image, reference, preference, seam, &mut Portion::new(observer, 0.0, 0.5))? else {
        return Ok(());
    };
    let mut levels = vec![finest];
    while let Some(coarser) = levels.last().filter(|level| level.free() > COARSEST).map(Level::halved) {
        levels.push(coarser?);
    }
    let mut coarser: Option<Level> = None;
    let Some(coarsest) = levels.last() else { return Ok(()) };
    let extra = ExtraCosts::near_borders(coarsest)?.between(preference.guide.matches, coarsest);
    while let Some(mut level) = levels.pop() {
        report(observer, Stage::Blend, 0.5 + 0.5 / (levels.len() + 1) as f32)?;
        level.cut(coarser.as_ref(), &extra)?;
        coarser = Some(level);
    }
    if let Some(mut level) = coarser {
        level.merge_islands()?;
        level.write(seam);
    }
    Ok(())
}
