//! Distance to a set of pixels.

use wide::u16x8;

use crate::Result;
use crate::each_row::for_each_row;
use crate::image::{filled, reserve};

/// Step lengths of the 5-7 chamfer distance: within 8 % of the Euclidean one, exact in integers.
pub(crate) const STRAIGHT: u32 = 5;
pub(crate) const DIAGONAL: u16 = 7;
/// Farther than any distance that makes a difference.
pub(crate) const FAR: u16 = u16::MAX;
/// Cells handled together.
const LANES: usize = 8;

/// Distance of every cell of a grid, `width` cells a row, from the nearest one of which `inside` is true: [`STRAIGHT`] to
/// the pixel; the greatest number if there is none, or none within 13 107 pixels.
pub(crate) fn distance(cells: usize, width: usize, inside: &dyn Fn(usize) -> bool) -> Result<Vec<u16>> {
    distance_up_to(FAR, cells, width, inside)
}

/// As [`distance`], the greatest number also where it would be more than `most`.
pub(crate) fn distance_up_to(
    most: u16,
    cells: usize,
    width: usize,
    inside: &dyn Fn(usize) -> bool,
) -> Result<Vec<u16>> {
    let mut grid = Vec::new();
    reserve(&mut grid, cells)?;
    for_each_row(0..cells / width, &mut |y| {
        grid.extend((y * width..(y + 1) * width).map(|cell| if inside(cell) { 0 } else { FAR }));
        Ok(())
    })?;
    carry(&mut grid, width, most)?;
    Ok(grid)
}

/// Distances up to `most` from the cells of a grid that are 0, where all others are [`FAR`]; what is farther stays that.
pub(crate) fn carry(grid: &mut [u16], width: usize, most: u16) -> Result<()> {
    // Rosenfeld and Pfaltz: once with the neighbours above and to the left, once with the other four.
    sweep(grid, width, most, false)?;
    sweep(grid, width, most, true)
}

/// Carries distances on to the right and downwards, or `back` to the left and upwards.
fn sweep(grid: &mut [u16], width: usize, most: u16, back: bool) -> Result<()> {
    const ALL_FAR: [u16; LANES] = [FAR; LANES];
    let rows = grid.len() / width;
    let in_turn = |i: usize, count: usize| if back { count - 1 - i } else { i };
    // The row before, with a cell more on the left and some on the right.
    let mut before = filled(width + 2 * LANES, FAR)?;
    for_each_row(0..rows, &mut |i| {
        let row = &mut grid[in_turn(i, rows) * width..][..width];
        let mut beside = u32::from(FAR);
        let blocks = width.div_ceil(LANES);
        for block in 0..blocks {
            let x = in_turn(block, blocks) * LANES;
            let cells = &mut row[x..(x + LANES).min(width)];
            let lanes = |x: usize| before[x..].first_chunk().map_or(u16x8::splat(FAR), |&lanes| u16x8::new(lanes));
            let (a, b, c) = (lanes(x), lanes(x + 1), lanes(x + 2));
            // Most of a grid is inside, or far from it.
            if *cells == [0; LANES] {
                beside = 0;
                continue;
            }
            if beside == u32::from(FAR) && *cells == ALL_FAR && a.min(b).min(c).to_array() == ALL_FAR {
                continue;
            }
            let across = a.min(c).saturating_add(u16x8::splat(DIAGONAL));
            let least = b.saturating_add(u16x8::splat(STRAIGHT as u16)).min(across).to_array();
            for i in 0..cells.len() {
                let i = in_turn(i, cells.len());
                let nearest = (beside + STRAIGHT).min(u32::from(least[i])).min(u32::from(cells[i]));
                beside = if nearest > u32::from(most) { u32::from(FAR) } else { nearest };
                cells[i] = beside as u16;
            }
        }
        before[1..=width].copy_from_slice(row);
        Ok(())
    })
}

/// Distance of a pixel from what is outside of a picture.
pub(crate) fn to_outside((x, y): (usize, usize), (width, height): (usize, usize)) -> u32 {
    (x + 1).min(y + 1).min(width - x).min(height - y) as u32 * STRAIGHT
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::sampler::Sampler;

    /// The cheapest way over the grid, by as many rounds as it takes.
    fn shortest(inside: &[bool], width: usize, most: u16) -> Vec<u16> {
        let mut found: Vec<u32> = inside.iter().map(|&inside| if inside { 0 } else { u32::from(FAR) }).collect();
        for _ in 0..found.len() {
            for at in 0..found.len() {
                let (x, y) = ((at % width) as isize, (at / width) as isize);
                for other in 0..found.len() {
                    let (dx, dy) = ((other % width) as isize - x, (other / width) as isize - y);
                    if dx.abs().max(dy.abs()) == 1 {
                        let step = if dx * dy == 0 { STRAIGHT } else { u32::from(DIAGONAL) };
                        found[at] = found[at].min(found[other] + step);
                    }
                }
            }
        }
        found.iter().map(|&distance| if distance > u32::from(most) { FAR } else { distance as u16 }).collect()
    }

    #[test]
    fn distances_are_the_shortest_ways() {
        let mut random = Sampler::new(7);
        for (width, height, share) in [(1, 9, 4), (8, 5, 20), (11, 6, 30), (19, 4, 50), (17, 5, 1000)] {
            let inside: Vec<bool> = (0..width * height).map(|_| random.below(share) == 0).collect();
            for most in [0, 9, 23, FAR] {
                let mut grid: Vec<u16> = inside.iter().map(|&inside| if inside { 0 } else { FAR }).collect();
                carry(&mut grid, width, most).unwrap();
                assert_eq!(grid, shortest(&inside, width, most));
            }
        }
    }
}
