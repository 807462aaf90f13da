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

impl Bilinear {
    /// Around a point of a photo of which each cell covers so many pixels along x and y, in a grid of so many columns and rows; values are those
    /// in the cells' middles. `None` within half a cell of the border, and outside.
    pub fn at(point: [f64; 2], cell: [f64; 2], columns: usize, rows: usize) -> Option<Self> {
        let [x, y] = [0, 1].map(|k| (point[k] + 0.5) / cell[k] - 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < columns as f64 - 1.0 && y < rows as f64 - 1.0;
        inside.then(|| Self {
            first: y as usize * columns + x as usize,
            columns,
            weights: [x.fract() as f32, y.fract() as f32],
        })
    }

    /// The value there, by those of all cells.
    pub fn interpolate<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(&self, cells: &[T]) -> T {
        let [u, v] = self.weights;
        let row = |at: usize| cells[at] * (1.0 - u) + cells[at + 1] * u;
        row(self.first) * (1.0 - v) + row(self.first + self.columns) * v
    }
}
