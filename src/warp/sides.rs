//! Lengths of the warped cells' sides: what tells a void outside the reference (paper, section 3.2.2).

use wide::{CmpEq, f32x4, i32x4};

use super::grid::{INVALID, PIXEL, Point, VertexGrid};
use super::raster::LANES;

/// How long a cell's sides may be. (The paper's text and the authors' program agree that either one makes a void; its
/// algorithm 2 asks for both.)
pub(super) struct StretchLimit {
    /// Longest mean horizontal and mean vertical side, in fixed point.
    longest: [f32; 2],
}

impl StretchLimit {
    /// `factor` times the average over all valid cells.
    pub fn new(grid: &VertexGrid, factor: f64) -> Self {
        Self { longest: average(grid).map(|side| (side * factor) as f32) }
    }

    /// Whether the cell with these corners, in turn from the top left, is a void.
    #[inline(always)]
    pub fn exceeded(&self, c: [Point; 4]) -> bool {
        let square = |a: Point, b: Point| {
            let (x, y) = ((b[0] - a[0]) as f32, (b[1] - a[1]) as f32);
            x * x + y * y
        };
        let [top, right, bottom, left] =
            [square(c[0], c[1]), square(c[1], c[2]), square(c[3], c[2]), square(c[0], c[3])];
        let [h, v] = self.longest;
        // Nearly all cells pass without a root.
        if top.max(bottom) <= h * h && left.max(right) <= v * v {
            return false;
        }
        0.5 * (top.sqrt() + bottom.sqrt()) > h || 0.5 * (left.sqrt() + right.sqrt()) > v
    }
}

/// Mean horizontal and mean vertical side over all valid cells, in fixed point.
fn average(grid: &VertexGrid) -> [f64; 2] {
    let (mut sum, mut cells) = ([0.0; 2], 0u64);
    for (above, below) in grid.cell_rows() {
        let mut row = [f32x4::splat(0.0); 2];
        for first in (0..grid.xs.len().saturating_sub(1)).step_by(LANES) {
            let [a, b, c, d] = [above.lanes(first), above.lanes(first + 1), below.lanes(first + 1), below.lanes(first)];
            let length = |p: [i32x4; 2], q: [i32x4; 2]| {
                let (x, y) = (f32x4::from_i32x4(q[0] - p[0]), f32x4::from_i32x4(q[1] - p[1]));
                (x * x + y * y).sqrt()
            };
            let invalid = a[0].min(b[0]).min(c[0].min(d[0])).cmp_eq(i32x4::splat(INVALID));
            let keep: f32x4 = bytemuck::cast(!invalid);
            row[0] += (length(a, b) + length(d, c)) & keep;
            row[1] += (length(a, d) + length(b, c)) & keep;
            cells += u64::from((!invalid).move_mask().count_ones());
        }
        for (sum, row) in sum.iter_mut().zip(row) {
            *sum += row.to_array().iter().map(|&side| 0.5 * f64::from(side)).sum::<f64>();
        }
    }
    sum.map(|sum| if cells == 0 { f64::from(PIXEL) } else { sum / cells as f64 })
}
