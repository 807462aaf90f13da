//! Voids outside the reference: cells that are stretched (paper, section 3.2.2, last paragraph).

use wide::{CmpEq, CmpGt, f32x4, i32x4};

use super::grid::{INVALID, PIXEL, VertexGrid};
use crate::Result;
use crate::lanes::LANES;

/// How long a cell's sides may be. (By the paper's text and the authors' program either the horizontal or the vertical side
/// makes a void; its algorithm 2 asks for both.)
pub(super) struct StretchLimit {
    /// Limits of the mean of a cell's two horizontal and of its two vertical sides, in fixed point.
    longest: [f32; 2],
}

impl StretchLimit {
    /// `factor` times the average over all valid cells.
    pub fn new(grid: &VertexGrid<'_>, factor: f64) -> Result<Self> {
        Ok(Self { longest: average(grid)?.map(|side| (side * factor) as f32) })
    }

    /// Which of four cells are voids. Corners in turn from the top left.
    #[inline(always)]
    pub fn exceeded(&self, &[a, b, c, d]: &[[i32x4; 2]; 4]) -> i32x4 {
        let [top, right, bottom, left] = [square(a, b), square(b, c), square(c, d), square(a, d)];
        let [h, v] = self.longest.map(f32x4::splat);
        // Nearly all cells pass without square roots.
        if (top.fast_max(bottom).cmp_gt(h * h) | left.fast_max(right).cmp_gt(v * v)).move_mask() == 0 {
            return i32x4::ZERO;
        }
        let mean = |a: f32x4, b: f32x4| f32x4::splat(0.5) * (a.sqrt() + b.sqrt());
        bytemuck::cast(mean(top, bottom).cmp_gt(h) | mean(left, right).cmp_gt(v))
    }
}

/// Squared distances.
#[inline(always)]
fn square(p: [i32x4; 2], q: [i32x4; 2]) -> f32x4 {
    let (x, y) = (f32x4::from_i32x4(q[0] - p[0]), f32x4::from_i32x4(q[1] - p[1]));
    x * x + y * y
}

/// Mean upper and mean left side of all valid cells, in fixed point: the lower and right ones are those of their neighbours.
fn average(grid: &VertexGrid<'_>) -> Result<[f64; 2]> {
    let (mut sum, mut cells) = ([0.0; 2], 0u64);
    grid.for_each_row(|_, above, below| {
        let mut row = [f32x4::splat(0.0); 2];
        for first in (0..grid.cells()[0]).step_by(LANES) {
            let ([a, b], [d, c]) = (above.lanes(first), below.lanes(first));
            let invalid = a[0].min(b[0]).min(c[0].min(d[0])).cmp_eq(i32x4::splat(INVALID));
            let keep: f32x4 = bytemuck::cast(!invalid);
            row[0] += square(a, b).sqrt() & keep;
            row[1] += square(a, d).sqrt() & keep;
            cells += u64::from((!invalid).move_mask().count_ones());
        }
        for (sum, row) in sum.iter_mut().zip(row) {
            *sum += row.to_array().iter().map(|&side| f64::from(side)).sum::<f64>();
        }
        Ok(())
    })?;
    Ok(sum.map(|sum| if cells == 0 { f64::from(PIXEL) } else { sum / cells as f64 }))
}
