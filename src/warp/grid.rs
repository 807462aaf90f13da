//! Forward map of the target's grid vertices into the reference's view (paper, section 3.2.1).

use super::canvas::Limits;
use crate::geometry::Model;
use crate::image::reserve;
use crate::{Error, InverseDepth, Result};

/// Vertices are kept on a grid of 2⁻¹⁰ px, so that edge functions are exact in `f64` and cells meet without gap or
/// overlap.
const SUBPIXEL: f64 = 1024.0;

/// The mapped vertices of C₁×C₂ cells over the target.
pub(super) struct VertexGrid {
    /// Target x of each column of vertices.
    pub xs: Vec<f64>,
    /// Target y of each row of vertices.
    pub ys: Vec<f64>,
    /// Mapped positions in reference pixels, row by row; NaN for a vertex behind the camera, at a hole or beyond the
    /// canvas limit.
    pub points: Vec<[f32; 2]>,
    /// Smallest and largest mapped x and y.
    pub bounds: [f64; 4],
    /// Mean lengths of the cells' horizontal and vertical sides.
    pub mean_side: [f64; 2],
    /// Whether a vertex lay beyond the canvas limit.
    pub clipped: bool,
}

impl VertexGrid {
    pub fn map(
        size: (usize, usize),
        depth: Option<&InverseDepth>,
        model: &Model,
        (columns, rows): (u32, u32),
        limits: &Limits,
    ) -> Result<Self> {
        let (xs, ys) = (axis(columns, size.0)?, axis(rows, size.1)?);
        let per_pixel = xs.len() == size.0 && ys.len() == size.1;
        let mut points = Vec::new();
        reserve(&mut points, xs.len() * ys.len())?;
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let mut clipped = false;
        let (h, e) = (&model.h, &model.e);
        for (j, &y) in ys.iter().enumerate() {
            let row = depth.filter(|_| per_pixel).map(|d| &d.data()[j * size.0..(j + 1) * size.0]);
            let base = [0, 1, 2].map(|k| h[(k, 1)] * y + h[(k, 2)]);
            for (i, &x) in xs.iter().enumerate() {
                let d = match (row, depth) {
                    (Some(row), _) => f64::from(row[i]),
                    (None, Some(depth)) => depth.sample(x, y),
                    (None, None) => 0.0,
                };
                let w = h[(2, 0)] * x + base[2] + e[2] * d;
                // Behind the camera, or a hole.
                if w <= 0.0 || w.is_nan() {
                    points.push([f32::NAN; 2]);
                    continue;
                }
                let u = snap((h[(0, 0)] * x + base[0] + e[0] * d) / w);
                let v = snap((h[(1, 0)] * x + base[1] + e[1] * d) / w);
                if !limits.contains(u, v) {
                    clipped = true;
                    points.push([f32::NAN; 2]);
                    continue;
                }
                bounds = [bounds[0].min(u), bounds[1].min(v), bounds[2].max(u), bounds[3].max(v)];
                points.push([u as f32, v as f32]);
            }
        }
        let mut grid = Self { xs, ys, points, bounds, mean_side: [0.0; 2], clipped };
        grid.mean_side = grid.measure_sides();
        Ok(grid)
    }

    /// Rows of cells with their corner points: the vertices of the row above and of the row below.
    pub fn cell_rows(&self) -> impl Iterator<Item = (&[[f32; 2]], &[[f32; 2]])> {
        let n = self.xs.len();
        self.points.chunks_exact(n).zip(self.points.chunks_exact(n).skip(1))
    }

    /// `no-overlap` when no vertex landed on the canvas.
    pub fn require_visible(&self) -> Result<()> {
        if self.bounds[0] <= self.bounds[2] { Ok(()) } else { Err(Error::NoOverlap { pixels: 0 }) }
    }

    fn measure_sides(&self) -> [f64; 2] {
        let (mut sum, mut cells) = ([0.0; 2], 0u64);
        for (above, below) in self.cell_rows() {
            for (a, b) in above.windows(2).zip(below.windows(2)) {
                let [h, v] = sides([a[0], a[1], b[1], b[0]]);
                if (h + v).is_finite() {
                    sum = [sum[0] + f64::from(h), sum[1] + f64::from(v)];
                    cells += 1;
                }
            }
        }
        sum.map(|s| s / cells.max(1) as f64)
    }
}

/// Mean horizontal and mean vertical side of a cell with corners in turn from the top left; NaN for an invalid cell.
#[inline]
pub(super) fn sides(c: [[f32; 2]; 4]) -> [f32; 2] {
    let length = |a: [f32; 2], b: [f32; 2]| {
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        (x * x + y * y).sqrt()
    };
    [(length(c[0], c[1]) + length(c[3], c[2])) / 2.0, (length(c[0], c[3]) + length(c[1], c[2])) / 2.0]
}

/// Vertex positions along one side: every pixel, or `cells` equal steps between the first and the last pixel.
fn axis(cells: u32, pixels: usize) -> Result<Vec<f64>> {
    let cells = if cells == 0 { pixels.saturating_sub(1) } else { (cells as usize).min(pixels.saturating_sub(1)) };
    let mut out = Vec::new();
    reserve(&mut out, cells + 1)?;
    let step = if cells == 0 { 0.0 } else { (pixels - 1) as f64 / cells as f64 };
    out.extend((0..=cells).map(|i| i as f64 * step));
    Ok(out)
}

#[inline]
fn snap(v: f64) -> f64 {
    (v * SUBPIXEL + 0.5).floor() / SUBPIXEL
}
