//! Distance to a set of pixels.

use wide::u16x8;

use crate::Result;
use crate::image::{filled, reserve};

/// Step lengths of the 5-7 chamfer distance: within 8 % of the Euclidean one, exact in integers.
pub(crate) const STRAIGHT: u32 = 5;
const DIAGONAL: u16 = 7;
/// Farther than any distance that makes a difference.
pub(crate) const FAR: u16 = u16::MAX;
/// Cells handled together.
const LANES: usize = 8;

/// Distance of every cell of a grid, `width` cells a row, from the nearest one of which `inside` is true: [`STRAIGHT`] to
/// the pixel; the greatest number if there is none, or none within 13 107 pixels.
pub(crate) fn distance(cells: usize, width: usize, inside: &dyn Fn(usize) -> bool) -> Result<Vec<u16>> {
    let mut grid = Vec::new();
    reserve(&mut grid, cells)?;
    grid.extend((0..cells).map(|cell| if inside(cell) { 0 } else { FAR }));
    carry(&mut grid, width, FAR)?;
    Ok(grid)
}

/// Distances up to `most` from the cells of a grid that are 0, where all others are [`FAR`]; what is farther stays that.
pub(crate) fn carry(grid: &mut [u16], width: usize, most: u16) -> Result<()> {
    // Rosenfeld and Pfaltz: once with the neighbours above and to the left, once with the other four, which are these
    // where the last cell is the first.
    for _ in 0..2 {
        sweep(grid, width, most)?;
        grid.reverse();
    }
    Ok(())
}

/// Carries distances on to the right and downwards.
fn sweep(grid: &mut [u16], width: usize, most: u16) -> Result<()> {
    const ALL_FAR: [u16; LANES] = [FAR; LANES];
    // The row above, with a cell more on the left and some on the right.
    let mut above = filled(width + 2 * LANES, FAR)?;
    for row in grid.chunks_exact_mut(width) {
        let mut left = u32::from(FAR);
        for (cells, above) in row.chunks_mut(LANES).zip(above.windows(LANES + 2).step_by(LANES)) {
            let lanes = |x: usize| above[x..].first_chunk().map_or(u16x8::splat(FAR), |&lanes| u16x8::new(lanes));
            let (a, b, c) = (lanes(0), lanes(1), lanes(2));
            // Most of a grid is inside, or far from it.
            if *cells == [0; LANES] {
                left = 0;
                continue;
            }
            if left == u32::from(FAR) && *cells == ALL_FAR && a.min(b).min(c).to_array() == ALL_FAR {
                continue;
            }
            let beside = a.min(c).saturating_add(u16x8::splat(DIAGONAL));
            let least = b.saturating_add(u16x8::splat(STRAIGHT as u16)).min(beside).to_array();
            for (cell, least) in cells.iter_mut().zip(least) {
                left = (left + STRAIGHT).min(u32::from(least)).min(u32::from(*cell));
                left = if left > u32::from(most) { u32::from(FAR) } else { left };
                *cell = left as u16;
            }
        }
        above[1..=width].copy_from_slice(row);
    }
    Ok(())
}

/// Distance of a pixel from what is outside of a picture.
pub(crate) fn to_outside((x, y): (usize, usize), (width, height): (usize, usize)) -> u32 {
    (x + 1).min(y + 1).min(width - x).min(height - y) as u32 * STRAIGHT
}
