//! Draws one row of warped cells.
//!
//! With one vertex per pixel a cell covers about one canvas pixel, sometimes none, sometimes two or four: branching on
//! that costs more than the arithmetic. So the pixels that small convex cells cover are collected first, four cells
//! at once, then located one after the other. All other cells take [`Cell`]'s way.

use wide::{CmpEq, CmpGt, CmpLt, f32x4, i32x4};

use super::cell::Cell;
use super::grid::{INVALID, PIXEL, Point, Row, SUBPIXEL_BITS};
use crate::Result;
use crate::image::zeroed;

/// Cells looked at together.
pub(super) const LANES: usize = 4;
const ALL: i32 = 0b1111;

/// A pixel covered by the cell of a column.
#[derive(Clone, Copy, Default)]
struct Covered {
    column: u32,
    x: i32,
    y: i32,
    /// Its place in the cell.
    u: f32,
    v: f32,
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
            for (k, mut lanes) in group.coverage(&border).into_iter().enumerate() {
                if lanes == 0 {
                    continue;
                }
                let [u, v] = group.inverse_bilinear(k).map(f32x4::to_array);
                let [x, y] = group.pixel(k).map(i32x4::to_array);
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % LANES;
                    lanes &= lanes - 1;
                    let column = (first + lane) as u32;
                    self.covered[count] = Covered { column, x: x[lane], y: y[lane], u: u[lane], v: v[lane] };
                    count += 1;
                }
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
        for &Covered { column, x, y, u, v } in &self.covered[..count] {
            draw(column as usize, &corners(column as usize), x, y, u, v);
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

    /// Pixel k of (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1), from the first pixel of the lane's bounding box.
    #[inline(always)]
    fn pixel(&self, k: usize) -> [i32x4; 2] {
        [self.first[0] + i32x4::splat(k as i32 & 1), self.first[1] + i32x4::splat(k as i32 >> 1)]
    }

    /// For each of the four pixels, the lanes whose cell is small and owns it.
    #[inline(always)]
    fn coverage(&self, border: &Border) -> [i32; 4] {
        if self.small == 0 {
            return [0; 4];
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
        least.map(|least| least.cmp_gt(zero).move_mask() & self.small)
    }

    /// Place of pixel k in its small cell, as the general way has it.
    #[inline(always)]
    fn inverse_bilinear(&self, k: usize) -> [f32x4; 2] {
        let float = |q: [i32x4; 2]| q.map(f32x4::from_i32x4);
        let cross = |p: [f32x4; 2], q: [f32x4; 2]| p[0] * q[1] - p[1] * q[0];
        let [ab, bc, _, da] = self.sides;
        let (e, f, g) = (float(ab), float(da.map(|side| -side)), float([bc[0] + da[0], bc[1] + da[1]]));
        let pixel = self.pixel(k);
        let h = float([0, 1].map(|axis| (pixel[axis] << SUBPIXEL_BITS as i32) - self.corners[0][axis]));
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let (k2, k1, k0) = (cross(g, f), cross(e, f) + cross(h, g), cross(h, e));
        let root = (k1 * k1 - f32x4::splat(4.0) * k2 * k0).fast_max(zero).sqrt();
        let v = (f32x4::splat(-2.0) * k0 / (k1 + root)).fast_max(zero).fast_min(one);
        let across = [e[0] + v * g[0], e[1] + v * g[1]];
        let along = [h[0] - v * f[0], h[1] - v * f[1]];
        let square = across[0] * across[0] + across[1] * across[1];
        let u = ((along[0] * across[0] + along[1] * across[1]) / square).fast_max(zero).fast_min(one);
        [u, v]
    }

    /// Lanes whose cell needs the general way.
    #[inline(always)]
    fn others(&self) -> i32 {
        self.visible & !self.small
    }
}
