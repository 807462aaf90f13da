//! Draws one row of warped cells.
//!
//! With one vertex per pixel a cell covers about one canvas pixel, sometimes none, sometimes two or four: branching on
//! that costs more than the arithmetic. So the pixels that small convex cells cover are collected first, four cells
//! at once, then located one after the other. All other cells take [`Cell`]'s way.

use wide::{CmpEq, CmpGt, CmpLt, i32x4};

use super::cell::{Cell, inverse_bilinear};
use super::grid::{INVALID, PIXEL, Point, Row, SUBPIXEL_BITS};
use crate::Result;
use crate::image::zeroed;

/// Cells looked at together.
pub(super) const LANES: usize = 4;
const ALL: i32 = 0b1111;

/// A pixel covered by the cell of a column.
#[derive(Clone, Copy, Default)]
struct Covered {
    x: i32,
    y: i32,
    column: u32,
}

/// Draws rows of cells; keeps its buffer from row to row.
pub(super) struct Rasteriser {
    columns: usize,
    covered: Vec<Covered>,
}

impl Rasteriser {
    /// For rows of `columns` cells.
    pub fn new(columns: usize) -> Result<Self> {
        Ok(Self { columns, covered: zeroed(4 * columns.next_multiple_of(LANES))? })
    }

    /// Calls `draw(column, corners, x, y, u, v)` for every pixel of every cell between two rows of vertices. (u, v) is
    /// the pixel's place in the cell, (0, 0) at the first and (1, 1) at the third of its corners. The last column, and
    /// with `last_row` every cell, owns the pixels on its outer side.
    pub fn draw_row(
        &mut self,
        above: Row<'_>,
        below: Row<'_>,
        last_row: bool,
        mut draw: impl FnMut(usize, &[Point; 4], i32, i32, f32, f32),
    ) {
        let corners = |column: usize| {
            [above.point(column), above.point(column + 1), below.point(column + 1), below.point(column)]
        };
        let mut count = 0;
        for first in (0..self.columns).step_by(LANES) {
            let border = Border { last_lane: self.columns - 1 - first, last_row };
            let group = CellGroup::new(above, below, first);
            let mut block = group.coverage(&border);
            while block != 0 {
                let bit = block.trailing_zeros() as usize;
                block &= block - 1;
                let (lane, k) = (bit % LANES, (bit / LANES) as i32);
                let (x, y) =
                    (group.first[0].as_array_ref()[lane] + (k & 1), group.first[1].as_array_ref()[lane] + (k >> 1));
                self.covered[count] = Covered { x, y, column: (first + lane) as u32 };
                count += 1;
            }
            let mut others = group.others();
            while others != 0 {
                let column = first + others.trailing_zeros() as usize;
                others &= others - 1;
                let corners = corners(column);
                if let Some(cell) = Cell::new(corners) {
                    let border = [column + 1 == self.columns, last_row];
                    cell.draw(border, |x, y, u, v| draw(column, &corners, x, y, u, v));
                }
            }
        }
        for &Covered { x, y, column } in &self.covered[..count] {
            let corners = corners(column as usize);
            let [u, v] = inverse_bilinear(&corners, x, y);
            draw(column as usize, &corners, x, y, u, v);
        }
    }
}

/// Which cells own the pixels on their outer sides.
struct Border {
    last_lane: usize,
    last_row: bool,
}

/// Four cells next to each other, one to a lane. Index 0 is x, index 1 is y.
struct CellGroup {
    corners: [[i32x4; 2]; 4],
    /// Sides from each corner to the next.
    sides: [[i32x4; 2]; 4],
    /// First pixel in the bounding box.
    first: [i32x4; 2],
    /// Lanes whose cell is convex and covers at most two by two pixels.
    small: i32,
    /// Lanes whose cell is valid and has a pixel in its bounding box.
    visible: i32,
}

impl CellGroup {
    #[inline(always)]
    fn new(above: Row<'_>, below: Row<'_>, first: usize) -> Self {
        let corners = [above.lanes(first), above.lanes(first + 1), below.lanes(first + 1), below.lanes(first)];
        let [a, b, c, d] = corners;
        let minus = |p: [i32x4; 2], q: [i32x4; 2]| [p[0] - q[0], p[1] - q[1]];
        let sides = [minus(b, a), minus(c, b), minus(d, c), minus(a, d)];
        let min = [0, 1].map(|k| a[k].min(b[k]).min(c[k].min(d[k])));
        let max = [0, 1].map(|k| a[k].max(b[k]).max(c[k].max(d[k])));
        let first = min.map(|min| (min + i32x4::splat(PIXEL - 1)) >> SUBPIXEL_BITS as i32);
        let extent = [0, 1].map(|k| (max[k] >> SUBPIXEL_BITS as i32) - first[k]);

        let valid = ALL & !min[0].cmp_eq(i32x4::splat(INVALID)).move_mask();
        let visible = valid & extent[0].min(extent[1]).cmp_gt(i32x4::splat(-1)).move_mask();
        let cross = |p: [i32x4; 2], q: [i32x4; 2]| p[0] * q[1] - p[1] * q[0];
        let turns = cross(sides[0], sides[1])
            .min(cross(sides[1], sides[2]))
            .min(cross(sides[2], sides[3]).min(cross(sides[3], sides[0])));
        let convex = turns.cmp_gt(i32x4::splat(0));
        let small = visible & (convex & extent[0].max(extent[1]).cmp_lt(i32x4::splat(2))).move_mask();
        Self { corners, sides, first, small, visible }
    }

    /// Which pixels belong to the small cells: bit 4·k + lane for pixel k of (x, y), (x + 1, y), (x, y + 1),
    /// (x + 1, y + 1) from the first pixel of the lane's bounding box.
    #[inline(always)]
    fn coverage(&self, border: &Border) -> u32 {
        if self.small == 0 {
            return 0;
        }
        let zero = i32x4::splat(0);
        let lane = |k: usize| -i32::from(k == border.last_lane);
        let row = i32x4::splat(-i32::from(border.last_row));
        let outer = [zero, i32x4::new([lane(0), lane(1), lane(2), lane(3)]), row, zero];
        let origin = self.first.map(|first| first << SUBPIXEL_BITS as i32);
        // The least edge function over the four sides, for each of the four pixels, is positive inside. A pixel exactly
        // on a side belongs to the cell by the top-left rule, or where no cell lies beyond: it gets 1 on top, as a
        // comparison that holds is −1.
        let mut least = [i32x4::splat(i32::MAX); 4];
        for k in 0..4 {
            let [dx, dy] = self.sides[k];
            let owns = dy.cmp_lt(zero) | (dy.cmp_eq(zero) & dx.cmp_gt(zero)) | outer[k];
            let edge = dx * (origin[1] - self.corners[k][1]) - dy * (origin[0] - self.corners[k][0]) - owns;
            let (right, down) = (dy << SUBPIXEL_BITS as i32, dx << SUBPIXEL_BITS as i32);
            least[0] = least[0].min(edge);
            least[1] = least[1].min(edge - right);
            least[2] = least[2].min(edge + down);
            least[3] = least[3].min(edge + down - right);
        }
        let mut bits = 0;
        for (k, least) in least.iter().enumerate() {
            bits |= (least.cmp_gt(zero).move_mask() & self.small) << (4 * k);
        }
        bits as u32
    }

    /// Lanes whose cell needs the general way.
    #[inline(always)]
    fn others(&self) -> i32 {
        self.visible & !self.small
    }
}
