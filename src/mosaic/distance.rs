//! Distance to a set of pixels.

use crate::Result;
use crate::image::reserve;

/// Step lengths of the 5-7 chamfer distance: within 8 % of the Euclidean one, exact in integers.
pub(super) const STRAIGHT: u32 = 5;
const DIAGONAL: u32 = 7;

/// Distance of every cell of a grid, `width` cells a row, from the nearest one of which `inside` is true: [`STRAIGHT`] to
/// the pixel; `u32::MAX` if there is none.
#[inline(never)]
pub(super) fn distance(cells: usize, width: usize, inside: &dyn Fn(usize) -> bool) -> Result<Vec<u32>> {
    let mut grid = Vec::new();
    reserve(&mut grid, cells)?;
    grid.extend((0..cells).map(|cell| if inside(cell) { 0 } else { u32::MAX }));
    // Rosenfeld and Pfaltz: once with the neighbours above and to the left, once with the other four.
    for backwards in [false, true] {
        for (first, x) in (0..cells).step_by(width).flat_map(|first| (0..width).map(move |x| (first, x))) {
            let i = first + x;
            let cell = if backwards { cells - 1 - i } else { i };
            let mut least = grid[cell];
            if least == 0 {
                continue;
            }
            // Cells left behind before this one: so many in its row, and whether there is a row.
            let mut look = |there: bool, steps: usize, length: u32| {
                if there {
                    let neighbour = if backwards { cell + steps } else { cell - steps };
                    least = least.min(grid[neighbour].saturating_add(length));
                }
            };
            look(x > 0, 1, STRAIGHT);
            look(first > 0, width, STRAIGHT);
            look(x > 0 && first > 0, width + 1, DIAGONAL);
            look(x + 1 < width && first > 0, width - 1, DIAGONAL);
            grid[cell] = least;
        }
    }
    Ok(grid)
}

/// Distance of a pixel from what is outside of a picture.
pub(super) fn to_outside((x, y): (usize, usize), (width, height): (usize, usize)) -> u32 {
    (x + 1).min(y + 1).min(width - x).min(height - y) as u32 * STRAIGHT
}
