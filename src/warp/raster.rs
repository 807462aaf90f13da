//! Draws one row of warped cells.
//!
//! With one vertex per pixel a cell covers about one canvas pixel, sometimes none, sometimes two or four: branching on
//! that costs more than the arithmetic. So the pixels that small convex cells cover are first collected without a
//! branch, then located one after the other. All other cells take [`Cell`]'s way.

use wide::{CmpEq, CmpGt, CmpLt, i32x4};

use super::cell::{Cell, inverse_bilinear, pixel_range};
use super::grid::{INVALID, Point, SUBPIXEL_BITS};
use crate::Result;
use crate::image::zeroed;

/// A pixel covered by the cell of a column.
#[derive(Clone, Copy, Default)]
struct Covered {
    x: i32,
    y: i32,
    column: u32,
}

/// Draws rows of cells; keeps its buffer from row to row.
pub(super) struct Rasteriser {
    covered: Vec<Covered>,
}

impl Rasteriser {
    /// For rows of `columns` cells.
    pub fn new(columns: usize) -> Result<Self> {
        Ok(Self { covered: zeroed(4 * columns)? })
    }

    /// Calls `draw(column, corners, x, y, u, v)` for every pixel of every cell between two rows of vertices. (u, v) is
    /// the pixel's place in the cell, (0, 0) at the first and (1, 1) at the third of its corners. The last column, and
    /// with `last_row` every cell, owns the pixels on its outer side.
    pub fn draw_row(
        &mut self,
        above: &[Point],
        below: &[Point],
        last_row: bool,
        mut draw: impl FnMut(usize, &[Point; 4], i32, i32, f32, f32),
    ) {
        let corners = |column: usize| [above[column], above[column + 1], below[column + 1], below[column]];
        let columns = above.len().min(below.len()).saturating_sub(1).min(self.covered.len() / 4);
        let mut count = 0;
        for column in 0..columns {
            let corners = corners(column);
            let border = [column + 1 == columns, last_row];
            if corners.iter().any(|corner| corner[0] == INVALID) {
                continue;
            }
            let ((x, x_last), (y, y_last)) = (pixel_range(&corners, 0), pixel_range(&corners, 1));
            let covers = if x_last - x <= 1 && y_last - y <= 1 { block_coverage(&corners, x, y, border) } else { None };
            if let Some(covers) = covers {
                for (k, &covers) in covers.iter().enumerate() {
                    let pixel = Covered { x: x + (k & 1) as i32, y: y + (k >> 1) as i32, column: column as u32 };
                    self.covered[count] = pixel;
                    count += usize::from(covers);
                }
            } else if let Some(cell) = Cell::new(corners) {
                cell.draw(border, |x, y, u, v| draw(column, &corners, x, y, u, v));
            }
        }
        for &Covered { x, y, column } in &self.covered[..count] {
            let corners = corners(column as usize);
            let [u, v] = inverse_bilinear(&corners, x, y);
            draw(column as usize, &corners, x, y, u, v);
        }
    }
}

/// Which of the pixels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) belong to a convex cell of at most a few pixels;
/// `None` for a cell that is not convex. Each vector holds one value for each of the four sides.
#[inline(always)]
fn block_coverage(&[a, b, c, d]: &[Point; 4], x: i32, y: i32, border: [bool; 2]) -> Option<[bool; 4]> {
    let axis = |k: usize| {
        let from = i32x4::new([a[k], b[k], c[k], d[k]]);
        let to = i32x4::new([b[k], c[k], d[k], a[k]]);
        let beyond = i32x4::new([c[k], d[k], a[k], b[k]]);
        (from, to - from, beyond - to)
    };
    let ((from_x, dx, next_dx), (from_y, dy, next_dy)) = (axis(0), axis(1));
    let zero = i32x4::splat(0);
    if (dx * next_dy - dy * next_dx).cmp_gt(zero).move_mask() != 0b1111 {
        return None;
    }
    let edge = dx * (i32x4::splat(y << SUBPIXEL_BITS) - from_y) - dy * (i32x4::splat(x << SUBPIXEL_BITS) - from_x);
    // A pixel exactly on a side belongs to the cell by the top-left rule, or where no cell lies beyond. A comparison
    // that holds is −1, and edge > −1 lets the 0 in.
    let border = i32x4::new([0, -i32::from(border[0]), -i32::from(border[1]), 0]);
    let least = dy.cmp_lt(zero) | (dy.cmp_eq(zero) & dx.cmp_gt(zero)) | border;
    let (right, down) = (dy << SUBPIXEL_BITS as i32, dx << SUBPIXEL_BITS as i32);
    let covers = |edge: i32x4| edge.cmp_gt(least).move_mask() == 0b1111;
    Some([covers(edge), covers(edge - right), covers(edge + down), covers(edge + down - right)])
}
