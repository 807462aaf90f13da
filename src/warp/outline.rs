//! A clean outline outside the reference: what a depth map frays there is no part of the scene.

use super::canvas::Canvas;
use crate::components::{connected_components, neighbours};
use crate::distance::{FAR, STRAIGHT, carry};
use crate::image::{reserve, zeroed};
use crate::{Image, ImageView, Mask, Result};

/// Half the width of what is too thin to stay, or to stay open, as a share of the reference's diagonal; in pixels at least.
const THIN: f64 = 0.0025;
const THINNEST: u32 = 2;
/// Pieces of the outline that do not touch the reference, and pieces in a void, smaller than these shares of the reference
/// are dropped.
const PIECE: usize = 20;
const SPECK: usize = 2000;

/// Drops small pieces outside the reference, and opens and closes the footprint there by a small disc: what it loses is
/// no longer shown, what it gains is void.
pub(super) fn clean(image: &mut Image, footprint: &mut Mask, canvas: &Canvas, reference: &ImageView<'_>) -> Result<()> {
    let (width, cells) = (canvas.width, canvas.width * canvas.height);
    let (left, top) = canvas.offset;
    let size = reference.size();
    let (w, h) = (size.0 as f64, size.1 as f64);
    let radius = ((THIN * (w * w + h * h).sqrt()) as u32).max(THINNEST) * STRAIGHT;
    // No photo is so large that this is not all of it.
    let radius = radius.min(u32::from(FAR) / 4) as u16;
    let mut covered: Vec<u8> = zeroed(cells)?;
    let mark_reference = |covered: &mut [u8]| {
        let rows = covered.chunks_exact_mut(width).skip(top).zip(reference.pixels().chunks_exact(size.0));
        for (covered, pixels) in rows {
            let there = covered.iter_mut().skip(left).zip(pixels).filter(|(_, pixel)| reference.is_there(**pixel));
            there.for_each(|(covered, _)| *covered = REFERENCE);
        }
    };
    // Specks in voids are filled over.
    covered.iter_mut().zip(image.pixels()).for_each(|(covered, pixel)| *covered = u8::from(pixel[3] != 0));
    mark_reference(&mut covered);
    drop_small(&mut covered, width, size.0 * size.1 / SPECK, &mut |at| image.pixels_mut()[at] = [0; 4])?;
    covered.iter_mut().zip(footprint.data()).for_each(|(covered, shown)| *covered = u8::from(*shown != 0));
    mark_reference(&mut covered);
    drop_small(&mut covered, width, size.0 * size.1 / PIECE, &mut |_| {})?;
    // Where a disc has room, and a margin around it, so that corners are not cut off.
    let mut distances = Vec::new();
    reserve(&mut distances, cells)?;
    distances.extend(covered.iter().map(|&covered| if covered == 0 { 0 } else { FAR }));
    open(&mut distances, width, radius, 3 * radius)?;
    for (covered, &outwards) in covered.iter_mut().zip(&distances) {
        if *covered == 1 && outwards == FAR {
            *covered = 0;
        }
    }
    // Gaps in which no disc has room, but not the steps of a slanting line.
    distances.clear();
    distances.extend(covered.iter().map(|&covered| if covered != 0 { 0 } else { FAR }));
    open(&mut distances, width, radius, radius + STRAIGHT as u16)?;
    for (at, covered) in covered.iter().enumerate().filter(|(_, covered)| **covered != REFERENCE) {
        let stays = *covered != 0 || distances[at] == FAR;
        footprint.data_mut()[at] = if stays { 255 } else { 0 };
        if !stays {
            image.pixels_mut()[at] = [0; 4];
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

/// Uncovers what hangs together, does not touch the reference and has fewer than `least` pixels.
fn drop_small(covered: &mut [u8], width: usize, least: usize, dropped: &mut dyn FnMut(usize)) -> Result<()> {
    let mut target = Vec::new();
    reserve(&mut target, covered.len())?;
    target.extend(covered.iter().map(|&covered| u8::from(covered == 1)));
    connected_components(target, width, least, &mut |piece| {
        let touches = |&at: &u32| neighbours(at as usize, width).iter().any(|&at| covered.get(at) == Some(&REFERENCE));
        if !piece.iter().any(touches) {
            for &at in piece {
                covered[at as usize] = 0;
                dropped(at as usize);
            }
        }
    })
}
