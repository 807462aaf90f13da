//! Distances on a grid.

use crate::Result;
use crate::image::reserve;

/// Step lengths of the 5-7 chamfer distance: within 8 % of the Euclidean one, exact in integers.
pub(super) const STRAIGHT: u32 = 5;
pub(super) const DIAGONAL: u32 = 7;

/// Lowers what is in the cells of a grid, `width` cells a row, to their chamfer distance from the nearest cell that
/// holds 0: [`STRAIGHT`] to the pixel. Starts from `u32::MAX` elsewhere, which stays if there is no 0.
#[inline(never)]
pub(super) fn spread(grid: &mut [u32], width: usize) {
    // Rosenfeld and Pfaltz: once with the neighbours above and to the left, once with the other four.
    for backwards in [false, true] {
        for i in 0..grid.len() {
            let cell = if backwards { grid.len() - 1 - i } else { i };
            let mut least = grid[cell];
            if least == 0 {
                continue;
            }
            // Cells left behind before this one: so many in its row, and whether there is a row.
            let x = i % width;
            let mut look = |steps: usize, length: u32| {
                let neighbour = if backwards { cell + steps } else { cell - steps };
                least = least.min(grid[neighbour].saturating_add(length));
            };
            if x > 0 {
                look(1, STRAIGHT);
            }
            if i >= width {
                look(width, STRAIGHT);
                if x > 0 {
                    look(width + 1, DIAGONAL);
                }
                if x + 1 < width {
                    look(width - 1, DIAGONAL);
                }
            }
            grid[cell] = least;
        }
    }
}

/// A grid to be [`spread`].
pub(super) fn starts(cells: usize, is_start: impl Fn(usize) -> bool) -> Result<Vec<u32>> {
    let mut grid = Vec::new();
    reserve(&mut grid, cells)?;
    grid.extend((0..cells).map(|cell| if is_start(cell) { 0 } else { u32::MAX }));
    Ok(grid)
}
