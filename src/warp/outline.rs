//! A clean outline outside the reference: what a depth map frays there is no part of the scene.

use std::ops::Range;

use super::canvas::Canvas;
use crate::components::{connected_components, neighbours};
use crate::distance::{FAR, STRAIGHT, carry};
use crate::image::{reserve, zeroed};
use crate::rect::diagonal;
use crate::{Image, ImageView, Mask, Result};

/// Half the width of what is too thin to stay, or to stay open, as a share of the reference's diagonal; in pixels at least.
const THIN: f64 = 0.0025;
const THINNEST: u32 = 2;
/// Pieces of the outline that do not touch the reference, and pieces in a void, smaller than these shares of the reference
/// are dropped.
const PIECE: usize = 20;
const SPECK: usize = 2000;

/// Drops small pieces and protruding voids outside the reference, and opens and closes the footprint there by a small disc: what it loses is
/// no longer shown, what it gains is void.
pub(super) fn clean(image: &mut Image, footprint: &mut Mask, canvas: &Canvas, reference: &ImageView<'_>) -> Result<()> {
    let (width, cells) = (canvas.width, canvas.width * canvas.height);
    let (left, top) = canvas.offset;
    let size = reference.size();
    let radius = ((THIN * diagonal(size)) as u32).max(THINNEST) * STRAIGHT;
    // No photo is so large that this is not all of it.
    let radius = radius.min(u32::from(FAR) / 4) as u16;
    // Specks in voids are filled over.
    let mut covered: Vec<u8> = zeroed(cells)?;
    covered.iter_mut().zip(image.pixels()).for_each(|(covered, pixel)| *covered = u8::from(pixel[3] != 0));
    let rows = covered.chunks_exact_mut(width).skip(top).zip(reference.pixels().chunks_exact(size.0));
    for (covered, pixels) in rows {
        let there = covered.iter_mut().skip(left).zip(pixels).filter(|(_, pixel)| reference.is_there(**pixel));
        there.for_each(|(covered, _)| *covered = REFERENCE);
    }
    drop_small(&mut covered, width, size.0 * size.1 / SPECK, &mut |piece| image.pixels_mut()[piece].fill([0; 4]))?;
    let beyond = covered.iter_mut().zip(footprint.data()).filter(|(covered, _)| **covered != REFERENCE);
    beyond.for_each(|(covered, shown)| *covered = u8::from(*shown != 0));
    drop_protruding_voids(&mut covered, width, image)?;
    drop_small(&mut covered, width, size.0 * size.1 / PIECE, &mut |_| {})?;
    // Where a disc has room, and a margin around it, so that corners are not cut off.
    let mut distances = Vec::new();
    reserve(&mut distances, cells)?;
    distances.extend(covered.iter().map(|&covered| if covered == 0 { 0 } else { FAR }));
    open(&mut distances, width, radius, 3 * radius)?;
    // Gaps in which no disc has room, but not the steps of a slanting line.
    for (covered, distance) in covered.iter_mut().zip(&mut distances) {
        if *covered == 1 && *distance == FAR {
            *covered = 0;
        }
        *distance = if *covered != 0 { 0 } else { FAR };
    }
    open(&mut distances, width, radius, radius + STRAIGHT as u16)?;
    let pixels = image.pixels_mut().iter_mut().zip(footprint.data_mut());
    for (((pixel, footprint), covered), &distance) in pixels.zip(covered).zip(&distances) {
        if covered == REFERENCE {
            continue;
        }
        let stays = covered != 0 || distance == FAR;
        *footprint = if stays { 255 } else { 0 };
        if !stays {
            *pixel = [0; 4];
        }
    }
    Ok(())
}

/// Of a grid that is 0 somewhere and [`FAR`] elsewhere, the distances up to `most` from the nearest cell that is farther than `radius`
/// from there.
fn open(grid: &mut [u16], width: usize, radius: u16, most: u16) -> Result<()> {
    carry(grid, width, radius)?;
    grid.iter_mut().for_each(|distance| *distance = if *distance == FAR { 0 } else { FAR });
    carry(grid, width, most)
}

/// What is covered by the reference; the target alone is 1.
const REFERENCE: u8 = 2;

/// Uncovers voids that border on nothing more than on what is shown: they stick out of the picture and do not lie in it.
fn drop_protruding_voids(covered: &mut [u8], width: usize, image: &Image) -> Result<()> {
    let mut voids = Vec::new();
    reserve(&mut voids, covered.len())?;
    voids.extend(covered.iter().zip(image.pixels()).map(|(&covered, pixel)| u8::from(covered == 1 && pixel[3] == 0)));
    connected_components(voids, width, usize::MAX, &mut |void| {
        let (mut outside, mut inside) = (0, 0);
        for at in void.iter().cloned().flatten().flat_map(|at| neighbours(at, width)) {
            match covered.get(at) {
                None | Some(0) => outside += 1,
                Some(1) if image.pixels()[at][3] == 0 => {}
                Some(_) => inside += 1,
            }
        }
        if outside > inside {
            void.iter().for_each(|span| covered[span.clone()].fill(0));
        }
    })
}

/// Uncovers what hangs together, does not touch the reference and has fewer than `least` pixels; the parts of rows that it lies in are
/// given to `dropped`.
fn drop_small(covered: &mut [u8], width: usize, least: usize, dropped: &mut dyn FnMut(Range<usize>)) -> Result<()> {
    let mut target = Vec::new();
    reserve(&mut target, covered.len())?;
    target.extend(covered.iter().map(|&covered| u8::from(covered == 1)));
    connected_components(target, width, least, &mut |piece| {
        let touches = |at: usize| neighbours(at, width).iter().any(|&at| covered.get(at) == Some(&REFERENCE));
        if !piece.iter().cloned().flatten().any(touches) {
            for span in piece {
                covered[span.clone()].fill(0);
                dropped(span.clone());
            }
        }
    })
}
