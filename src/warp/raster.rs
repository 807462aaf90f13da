//! Rasterises one row of warped cells (paper, section 3.2.1).
//!
//! With one vertex per pixel a cell covers about one canvas pixel, sometimes none, sometimes a few. Such small convex
//! cells are processed four at once; all others by [`Cell`]. The pixels found are passed on in batches.

use wide::{CmpEq, CmpGt, CmpLt, f32x4, i32x4};

use super::batch::{Batch, Covered};
use super::cell::Cell;
use super::grid::{INVALID, PIXEL, Point, Row, SUBPIXEL_BITS};
use super::stretch::StretchLimit;
use crate::lanes::LANES;

/// A small cell has fewer pixels than this across and down: far fewer than make an edge function overflow.
const SMALL: i32 = 17;

/// Calls `draw` with batches of the pixels of all cells between two rows of vertices, `columns` cells a row. The last
/// column, and with `last_row` every cell, owns the pixels on its outer side. `batch` is empty, and is again afterwards.
pub(super) fn draw_row(
    above: Row<'_>,
    below: Row<'_>,
    columns: usize,
    last_row: bool,
    stretch: &StretchLimit,
    batch: &mut Batch,
    mut draw: impl FnMut(&Batch),
) {
    let mut push = |lanes: i32, four: Covered| {
        if batch.is_full() {
            draw(batch);
            batch.count = 0;
        }
        batch.push(lanes, four);
    };
    for first in (0..columns).step_by(LANES) {
        let group = CellGroup::new(above, below, first);
        let stretched = stretch.exceeded(&group.corners);
        let start = f32x4::splat(first as f32) + f32x4::new([0.0, 1.0, 2.0, 3.0]);
        if group.small.move_mask() != 0 {
            let inverse = InverseBilinear::new(&group);
            group.small_cells(columns - 1 - first, last_row, |lanes, right, down| {
                let [u, v] = inverse.at(right, down);
                let [x, y] = [group.first[0] + right, group.first[1] + down];
                push(lanes, Covered { x, y, u: start + u, v, stretched });
            });
        }
        let mut others = group.others();
        while others != 0 {
            let lane = others.trailing_zeros() as usize;
            let column = first + lane;
            others &= others - 1;
            if let Some(cell) = Cell::new(corners(above, below, column)) {
                cell.draw([column + 1 == columns, last_row], |x, y, u, v| {
                    let ([x, y], [u, v]) = ([x, y].map(i32x4::splat), [u, v].map(f32x4::splat));
                    push(1 << lane, Covered { x, y, u: start + u, v, stretched });
                });
            }
        }
    }
    draw(batch);
    batch.count = 0;
}

/// Corners of a cell in turn from the top left.
fn corners(above: Row<'_>, below: Row<'_>, column: usize) -> [Point; 4] {
    [above.point(column), above.point(column + 1), below.point(column + 1), below.point(column)]
}

/// Four cells next to each other, one to a lane. Index 0 is x, index 1 is y.
struct CellGroup {
    corners: [[i32x4; 2]; 4],
    /// Sides from each corner to the next.
    sides: [[i32x4; 2]; 4],
    /// First pixel in the bounding box.
    first: [i32x4; 2],
    /// Width and height of the bounding box in pixels, 0 for cells that are not small.
    extent: [i32x4; 2],
    /// Cells that are convex and small.
    small: i32x4,
    /// Cells that are valid and have a pixel in their bounding box.
    visible: i32x4,
}

impl CellGroup {
    #[inline(always)]
    fn new(above: Row<'_>, below: Row<'_>, first: usize) -> Self {
        let ([a, b], [d, c]) = (above.lanes(first), below.lanes(first));
        let corners = [a, b, c, d];
        let minus = |p: [i32x4; 2], q: [i32x4; 2]| [p[0] - q[0], p[1] - q[1]];
        let sides = [minus(b, a), minus(c, b), minus(d, c), minus(a, d)];
        let min = [0, 1].map(|k| a[k].min(b[k]).min(c[k].min(d[k])));
        let max = [0, 1].map(|k| a[k].max(b[k]).max(c[k].max(d[k])));
        let first = min.map(|min| (min + i32x4::splat(PIXEL - 1)) >> SUBPIXEL_BITS as i32);
        let pixels = |k: usize| (max[k] >> SUBPIXEL_BITS as i32) - first[k] + i32x4::splat(1);
        let extent = [pixels(0), pixels(1)];

        let valid = !min[0].cmp_eq(i32x4::splat(INVALID));
        let visible = valid & extent[0].min(extent[1]).cmp_gt(i32x4::ZERO);
        let cross = |p: [i32x4; 2], q: [i32x4; 2]| p[0] * q[1] - p[1] * q[0];
        // As the sides go all the way round, the turns at b and d have the same sum as those at a and c.
        let [at_b, at_c, at_d] = [cross(sides[0], sides[1]), cross(sides[1], sides[2]), cross(sides[2], sides[3])];
        let convex = at_b.min(at_c).min(at_d.min(at_b + at_d - at_c)).cmp_gt(i32x4::ZERO);
        let small = visible & convex & extent[0].max(extent[1]).cmp_lt(i32x4::splat(SMALL));
        let extent = [extent[0] & small, extent[1] & small];
        Self { corners, sides, first, extent, small, visible }
    }

    /// Calls `found` with the pixels of the small cells, by their offsets from the first pixels of the bounding boxes: a bit
    /// for each lane that has one. The last column is that of `last_lane`.
    #[inline(always)]
    fn small_cells(&self, last_lane: usize, last_row: bool, mut found: impl FnMut(i32, i32x4, i32x4)) {
        // Most cells cover one pixel or none: pixels of different cells are collected and passed on together.
        let (mut lanes, mut right, mut down) = (i32x4::ZERO, i32x4::ZERO, i32x4::ZERO);
        let mut row = self.edges(last_lane, last_row);
        let mut j = i32x4::ZERO;
        while self.reaches(1, j) {
            let (mut edges, mut i) = (row, i32x4::ZERO);
            while self.reaches(0, i) {
                // Outside the bounding box one of them is negative.
                let least = edges[0].min(edges[1]).min(edges[2].min(edges[3]));
                let covered = least.cmp_gt(i32x4::ZERO) & self.small;
                if (covered & lanes).move_mask() != 0 {
                    found(lanes.move_mask(), right, down);
                    lanes = i32x4::ZERO;
                }
                (right, down) = (covered.blend(i, right), covered.blend(j, down));
                lanes |= covered;
                for (edge, side) in edges.iter_mut().zip(&self.sides) {
                    *edge -= side[1] << SUBPIXEL_BITS as i32;
                }
                i += i32x4::splat(1);
            }
            for (edge, side) in row.iter_mut().zip(&self.sides) {
                *edge += side[0] << SUBPIXEL_BITS as i32;
            }
            j += i32x4::splat(1);
        }
        if lanes.move_mask() != 0 {
            found(lanes.move_mask(), right, down);
        }
    }

    /// Whether one of the small cells is wider (axis 0) or higher (axis 1) than so many pixels.
    #[inline(always)]
    fn reaches(&self, axis: usize, pixels: i32x4) -> bool {
        self.extent[axis].cmp_gt(pixels).move_mask() != 0
    }

    /// The edge functions of the four sides at the first pixel, positive inside. A pixel exactly on a side belongs to the
    /// cell by the top-left rule, or where no cell lies beyond, as for the last column and row: it gets 1 on top, as a
    /// comparison that holds is −1.
    #[inline(always)]
    fn edges(&self, last_lane: usize, last_row: bool) -> [i32x4; 4] {
        let lane = |k: usize| -i32::from(k == last_lane);
        let (right, bottom) = (i32x4::new([lane(0), lane(1), lane(2), lane(3)]), i32x4::splat(-i32::from(last_row)));
        let origin = [self.first[0] << SUBPIXEL_BITS as i32, self.first[1] << SUBPIXEL_BITS as i32];
        let edge = |[dx, dy]: [i32x4; 2], [x, y]: [i32x4; 2], outer: i32x4| {
            let owns = dy.cmp_lt(i32x4::ZERO) | (dy.cmp_eq(i32x4::ZERO) & dx.cmp_gt(i32x4::ZERO)) | outer;
            dx * (origin[1] - y) - dy * (origin[0] - x) - owns
        };
        let ([ab, bc, cd, da], [a, b, c, d]) = (self.sides, self.corners);
        [edge(ab, a, i32x4::ZERO), edge(bc, b, right), edge(cd, c, bottom), edge(da, d, i32x4::ZERO)]
    }

    /// Lanes whose cell is not small and convex, one bit each.
    #[inline(always)]
    fn others(&self) -> i32 {
        (self.visible & !self.small).move_mask()
    }
}

/// The inverse of the cells' bilinear maps, as in [`Cell`], for four cells at once.
struct InverseBilinear {
    /// Sides ab and ad, and the deviation from a parallelogram, a − b + c − d.
    e: [f32x4; 2],
    f: [f32x4; 2],
    g: [f32x4; 2],
    /// The first pixel of the bounding box from the first corner.
    h: [f32x4; 2],
    ef: f32x4,
    gf: f32x4,
}

#[inline(always)]
fn cross(p: [f32x4; 2], q: [f32x4; 2]) -> f32x4 {
    p[0] * q[1] - p[1] * q[0]
}

impl InverseBilinear {
    #[inline(always)]
    fn new(group: &CellGroup) -> Self {
        let float = |q: [i32x4; 2]| q.map(f32x4::from_i32x4);
        let ([ab, bc, _, da], [a, _, _, d]) = (group.sides, group.corners);
        let (e, f, g) = (float(ab), float([d[0] - a[0], d[1] - a[1]]), float([bc[0] + da[0], bc[1] + da[1]]));
        let from_a = |axis: usize| (group.first[axis] << SUBPIXEL_BITS as i32) - a[axis];
        let h = float([from_a(0), from_a(1)]);
        Self { e, f, g, h, ef: cross(e, f), gf: cross(g, f) }
    }

    /// Positions (u, v) of the pixels at these offsets from the first pixels of the bounding boxes.
    #[inline(always)]
    fn at(&self, right: i32x4, down: i32x4) -> [f32x4; 2] {
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let step = |far: i32x4| f32x4::from_i32x4(far << SUBPIXEL_BITS as i32);
        let (e, f, g, h) = (self.e, self.f, self.g, [self.h[0] + step(right), self.h[1] + step(down)]);
        let (k1, k0) = (self.ef + cross(h, g), cross(h, e));
        let root = (k1 * k1 - f32x4::splat(4.0) * self.gf * k0).fast_max(zero).sqrt();
        let v = (f32x4::splat(-2.0) * k0 / (k1 + root)).fast_max(zero).fast_min(one);
        let across = [e[0] + v * g[0], e[1] + v * g[1]];
        let along = [h[0] - v * f[0], h[1] - v * f[1]];
        let square = across[0] * across[0] + across[1] * across[1];
        let u = ((along[0] * across[0] + along[1] * across[1]) / square).fast_max(zero).fast_min(one);
        [u, v]
    }
}
