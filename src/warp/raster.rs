//! Draws one row of warped cells.
//!
//! With one vertex per pixel a cell covers about one canvas pixel, sometimes none, sometimes two or four. Such small
//! convex cells are looked at four at once; all others take [`Cell`]'s way. Either way the pixels found are handed on in
//! batches.

use wide::{CmpEq, CmpGt, CmpLt, f32x4, i32x4};

use super::cell::Cell;
use super::grid::{INVALID, PIXEL, Point, Row, SUBPIXEL_BITS};
use super::sides::StretchLimit;

/// Cells looked at together.
pub(super) const LANES: usize = 4;
const ALL: i32 = 0b1111;

/// Pixels in a batch, at most: what the processor's nearest cache holds.
pub(super) const BATCH: usize = 1024;
/// Most pixels that a group of small cells covers.
const MOST_PER_GROUP: usize = 4 * LANES;

/// A pixel, in reference coordinates, covered by the cell of a column.
#[derive(Clone, Copy, Default)]
pub(super) struct Covered {
    pub column: u32,
    pub x: i32,
    pub y: i32,
    /// Its place in the cell, (0, 0) at the first and (1, 1) at the third corner.
    pub u: f32,
    pub v: f32,
    /// Whether the cell is longer than the limit.
    pub stretched: bool,
}

/// Covered pixels on their way to `draw`.
struct Batch<'a, F> {
    pixels: &'a mut [Covered; BATCH],
    count: usize,
    draw: F,
}

impl<F: FnMut(&[Covered])> Batch<'_, F> {
    /// Makes room for `more` pixels.
    #[inline(always)]
    fn reserve(&mut self, more: usize) {
        if self.count + more > BATCH {
            self.flush();
        }
    }

    #[inline(never)]
    fn flush(&mut self) {
        (self.draw)(&self.pixels[..self.count]);
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, pixel: Covered) {
        self.pixels[self.count % BATCH] = pixel;
        self.count += 1;
    }
}

/// Calls `draw` with batches of the pixels of all cells between two rows of vertices, `columns` cells a row. The last
/// column, and with `last_row` every cell, owns the pixels on its outer side. `buffer` is for reuse from row to row.
pub(super) fn draw_row(
    above: Row<'_>,
    below: Row<'_>,
    columns: usize,
    last_row: bool,
    stretch: &StretchLimit,
    buffer: &mut [Covered; BATCH],
    draw: impl FnMut(&[Covered]),
) {
    let mut batch = Batch { pixels: buffer, count: 0, draw };
    for first in (0..columns).step_by(LANES) {
        let group = CellGroup::new(above, below, first);
        let stretched = stretch.exceeded(&group.corners);
        batch.reserve(MOST_PER_GROUP);
        let inverse = InverseBilinear::new(&group);
        for (k, mut lanes) in group.coverage(columns - 1 - first, last_row).into_iter().enumerate() {
            if lanes == 0 {
                continue;
            }
            let [u, v] = inverse.at(k).map(f32x4::to_array);
            let [x, y] = group.pixel(k).map(i32x4::to_array);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % LANES;
                lanes &= lanes - 1;
                batch.push(Covered {
                    column: (first + lane) as u32,
                    x: x[lane],
                    y: y[lane],
                    u: u[lane],
                    v: v[lane],
                    stretched: stretched >> lane & 1 != 0,
                });
            }
        }
        let mut others = group.others();
        while others != 0 {
            let lane = others.trailing_zeros() as usize;
            let (column, stretched) = (first + lane, stretched >> lane & 1 != 0);
            others &= others - 1;
            if let Some(cell) = Cell::new(corners(above, below, column)) {
                cell.draw([column + 1 == columns, last_row], |x, y, u, v| {
                    batch.reserve(1);
                    batch.push(Covered { column: column as u32, x, y, u, v, stretched });
                });
            }
        }
    }
    batch.flush();
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

    /// For each of the four pixels, the lanes whose cell is small and owns it. Cells of the last column and row own the
    /// pixels on their outer sides.
    #[inline(always)]
    fn coverage(&self, last_lane: usize, last_row: bool) -> [i32; 4] {
        if self.small == 0 {
            return [0; 4];
        }
        let zero = i32x4::splat(0);
        let lane = |k: usize| -i32::from(k == last_lane);
        let row = i32x4::splat(-i32::from(last_row));
        let outer = [zero, i32x4::new([lane(0), lane(1), lane(2), lane(3)]), row, zero];
        let origin = self.first.map(|first| first << SUBPIXEL_BITS as i32);
        // The least edge function over the four sides, for each of the four pixels, is positive inside. A pixel exactly
        // on a side belongs to the cell by the top-left rule, or where no cell lies beyond: it gets 1 on top, as a
        // comparison that holds is −1.
        let mut least = [i32x4::splat(i32::MAX); 4];
        for ((&[dx, dy], [x, y]), outer) in self.sides.iter().zip(self.corners).zip(outer) {
            let owns = dy.cmp_lt(zero) | (dy.cmp_eq(zero) & dx.cmp_gt(zero)) | outer;
            let edge = dx * (origin[1] - y) - dy * (origin[0] - x) - owns;
            let (right, down) = (dy << SUBPIXEL_BITS as i32, dx << SUBPIXEL_BITS as i32);
            least[0] = least[0].min(edge);
            least[1] = least[1].min(edge - right);
            least[2] = least[2].min(edge + down);
            least[3] = least[3].min(edge + down - right);
        }
        least.map(|least| least.cmp_gt(zero).move_mask() & self.small)
    }

    /// Lanes whose cell needs the general way.
    #[inline(always)]
    fn others(&self) -> i32 {
        self.visible & !self.small
    }
}

/// The inverse of the cells' bilinear maps, as [`Cell`] has it, for four cells at once.
struct InverseBilinear {
    /// Sides ab and ad, and what makes the cell differ from a parallelogram.
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
        let [ab, bc, _, da] = group.sides;
        let (e, f, g) = (float(ab), float(da.map(|side| -side)), float([bc[0] + da[0], bc[1] + da[1]]));
        let h = float([0, 1].map(|axis| (group.first[axis] << SUBPIXEL_BITS as i32) - group.corners[0][axis]));
        Self { e, f, g, h, ef: cross(e, f), gf: cross(g, f) }
    }

    /// Places of pixel k in their cells.
    #[inline(always)]
    fn at(&self, k: usize) -> [f32x4; 2] {
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let step = |far: usize| f32x4::splat((far as i32 * PIXEL) as f32);
        let (e, f, g, h) = (self.e, self.f, self.g, [self.h[0] + step(k & 1), self.h[1] + step(k >> 1)]);
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
