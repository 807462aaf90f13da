//! A clean outline outside the reference: what a depth map frays there is no part of the scene.

use super::canvas::Canvas;
use crate::components::{connected_components, neighbours};
use crate::distance::{STRAIGHT, distance};
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
    let outwards = opened(cells, width, radius, &|at| covered[at] == 0)?;
    for (at, covered) in covered.iter_mut().enumerate() {
        if *covered == 1 && u32::from(outwards[at]) > 3 * radius {
            *covered = 0;
        }
    }
    drop(outwards);
    // Gaps in which no disc has room, but not the steps of a slanting line.
    let to_open = opened(cells, width, radius, &|at| covered[at] != 0)?;
    for (at, covered) in covered.iter().enumerate().filter(|(_, covered)| **covered != REFERENCE) {
        let stays = *covered != 0 || u32::from(to_open[at]) > radius + STRAIGHT;
        footprint.data_mut()[at] = if stays { 255 } else { 0 };
        if !stays {
            image.pixels_mut()[at] = [0; 4];
        }
    }
    Ok(())
}

/// Distance of every cell from the nearest one that is farther than `radius` from where `inside` is true.
fn opened(cells: usize, width: usize, radius: u32, inside: &dyn Fn(usize) -> bool) -> Result<Vec<u16>> {
    let inwards = distance(cells, width, inside)?;
    distance(cells, width, &|at| u32::from(inwards[at]) > radius)
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
