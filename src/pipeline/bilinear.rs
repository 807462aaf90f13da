//! Bilinear interpolation on a coarse grid over a photo.

use std::ops::{Add, Mul};

/// The four cells around a point, and their weights.
pub(super) struct Bilinear {
    /// Index of the upper left one, row by row.
    first: usize,
    columns: usize,
    /// The weight of the right ones, and of the lower ones.
    weights: [f32; 2],
}

/// A point of a photo as a place in a grid of which each cell covers so many pixels along x and y: see [`Bilinear::at`].
pub(super) fn in_cells(point: [f64; 2], cell: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| (point[k] + 0.5) / cell[k] - 0.5)
}

impl Bilinear {
    /// Around a place, counted in cells from the middle of the first one, in a grid of so many columns and rows. `None` outside of the middles of
    /// the outer ones.
    #[inline(always)]
    pub fn at([x, y]: [f64; 2], columns: usize, rows: usize) -> Option<Self> {
        let inside = x >= 0.0 && y >= 0.0 && x < columns as f64 - 1.0 && y < rows as f64 - 1.0;
        inside.then(|| {
            let (i, j) = (x as usize, y as usize);
            Self { first: j * columns + i, columns, weights: [(x - i as f64) as f32, (y - j as f64) as f32] }
        })
    }

    /// The value there, by those of all cells.
    #[inline(always)]
    pub fn interpolate<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(&self, cells: &[T]) -> T {
        let [u, v] = self.weights;
        let row = |at: usize| cells[at] * (1.0 - u) + cells[at + 1] * u;
        row(self.first) * (1.0 - v) + row(self.first + self.columns) * v
    }
}
