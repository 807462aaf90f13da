//! Means over cells of growing size (Burt 1988, "pull-push").

use crate::Result;
use crate::image::zeroed;
use crate::upsampling::{WEIGHTS, neighbours};

/// Sums of deviations and of weights over cells.
pub(super) struct Level {
    cells: Vec<[f32; 2]>,
    width: usize,
    height: usize,
}

impl Level {
    fn new(width: usize, height: usize) -> Result<Self> {
        Ok(Self { cells: zeroed(width * height)?, width, height })
    }

    /// How far what is `known` (NaN elsewhere) deviates from what is `expected`, both row by row, in cells of 2×2.
    pub fn of(width: usize, expected: &[f32], known: &[f32]) -> Result<Self> {
        let height = known.len() / width;
        let mut level = Self::new(width.div_ceil(2), height.div_ceil(2))?;
        for (y, (expected, known)) in expected.chunks_exact(width).zip(known.chunks_exact(width)).enumerate() {
            let row = &mut level.cells[y / 2 * level.width..];
            for (x, (expected, known)) in expected.iter().zip(known).enumerate() {
                if !known.is_nan() {
                    row[x / 2][0] += 0.25 * (known - expected);
                    row[x / 2][1] += 0.25;
                }
            }
        }
        Ok(level)
    }

    /// Mean deviations where there are any, those of coarser levels where there are few, 0 where the level whose cells
    /// are `reach` wide has none.
    pub fn extrapolated(self, reach: f64) -> Result<Self> {
        let coarser = if reach > 1.0 && self.width.min(self.height) > 1 {
            Some(self.half()?.extrapolated(0.5 * reach)?)
        } else {
            None
        };
        let mut out = self.blurred()?;
        let width = out.width;
        for (i, cell) in out.cells.iter_mut().enumerate() {
            let share = (4.0 * cell[1]).min(1.0);
            let rest = coarser.as_ref().map_or(0.0, |c| c.above(i % width, i / width));
            let mean = if cell[1] > 0.0 { cell[0] / cell[1] } else { 0.0 };
            cell[0] = rest + share * (mean - rest);
        }
        Ok(out)
    }

    fn half(&self) -> Result<Self> {
        let mut half = Self::new(self.width.div_ceil(2), self.height.div_ceil(2))?;
        for (i, cell) in self.cells.iter().enumerate() {
            let (x, y) = (i % self.width / 2, i / self.width / 2);
            half.cells[y * half.width + x].iter_mut().zip(cell).for_each(|(sum, v)| *sum += 0.25 * v);
        }
        Ok(half)
    }

    /// Binomial over 3×3 cells, cells outside having no weight.
    fn blurred(&self) -> Result<Self> {
        let (w, h) = (self.width, self.height);
        let mut rows = Self::new(w, h)?;
        for (from, to) in self.cells.chunks_exact(w).zip(rows.cells.chunks_exact_mut(w)) {
            for x in 0..w {
                let of = |x: Option<usize>| x.and_then(|x| from.get(x)).copied().unwrap_or_default();
                let (a, b, c) = (of(x.checked_sub(1)), from[x], of(Some(x + 1)));
                to[x] = [0, 1].map(|k| 0.25 * a[k] + 0.5 * b[k] + 0.25 * c[k]);
            }
        }
        let mut out = Self::new(w, h)?;
        for y in 0..h {
            for x in 0..w {
                let of = |y: Option<usize>| y.and_then(|y| rows.cells.get(y * w + x)).copied().unwrap_or_default();
                let (a, b, c) = (of(y.checked_sub(1)), rows.cells[y * w + x], of(Some(y + 1)));
                out.cells[y * w + x] = [0, 1].map(|k| 0.25 * a[k] + 0.5 * b[k] + 0.25 * c[k]);
            }
        }
        Ok(out)
    }

    /// Bilinear value at a cell of the next finer level.
    pub fn above(&self, x: usize, y: usize) -> f32 {
        let (columns, rows) = (neighbours(x, self.width), neighbours(y, self.height));
        let cell = |x: usize, y: usize| self.cells[y * self.width + x][0];
        let [near, far] = rows.map(|y| WEIGHTS[0] * cell(columns[0], y) + WEIGHTS[1] * cell(columns[1], y));
        WEIGHTS[0] * near + WEIGHTS[1] * far
    }
}
