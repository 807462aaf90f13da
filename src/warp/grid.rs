//! Forward map of the target's grid vertices into the reference's view (paper, section 3.2.1).

use wide::i32x4;

use super::canvas::Limits;
use super::raster::LANES;
use crate::geometry::Model;
use crate::image::{filled, zeroed};
use crate::{Error, InverseDepth, Result};

/// Binary digits after the point of a [`Point`]. On this grid edge functions are exact in integers, so neighbouring
/// cells meet without gap or overlap.
pub(super) const SUBPIXEL_BITS: u32 = 10;
/// One pixel in fixed point.
pub(super) const PIXEL: i32 = 1 << SUBPIXEL_BITS;
const SUBPIXEL: f64 = PIXEL as f64;

/// A mapped position in fixed point; both are [`INVALID`] for a vertex behind the camera, at a hole or beyond the canvas
/// limit.
pub(super) type Point = [i32; 2];
pub(super) const INVALID: i32 = i32::MIN;

/// The mapped vertices of C₁×C₂ cells over the target.
pub(super) struct VertexGrid {
    /// Columns and rows of cells.
    pub cells: [usize; 2],
    /// Width and height of a cell in target pixels: vertex (i, j) lies at (i, j) times this.
    pub step: [f64; 2],
    /// Mapped x and y in reference pixels, row by row; rows are filled up with [`INVALID`] to `stride`.
    x: Vec<i32>,
    y: Vec<i32>,
    stride: usize,
    /// Smallest and largest mapped x and y.
    pub bounds: [f64; 4],
    /// Whether a vertex lay beyond the canvas limit.
    pub clipped: bool,
}

impl VertexGrid {
    /// Maps all vertices. `no-overlap` when none lands on the canvas.
    pub fn map(
        size: (usize, usize),
        depth: Option<&InverseDepth>,
        model: &Model,
        (columns, rows): (u32, u32),
        limits: &Limits,
    ) -> Result<Self> {
        let ((columns, dx), (rows, dy)) = (axis(columns, size.0), axis(rows, size.1));
        let stride = columns.next_multiple_of(LANES) + 1;
        let mut px = filled(stride * (rows + 1), INVALID)?;
        let mut py = filled(stride * (rows + 1), INVALID)?;
        let (mut clipped, mut least, mut most) = (false, [i32::MAX; 2], [INVALID; 2]);
        let mut depths: Vec<f32> = zeroed(columns + 1)?;
        for (j, (row_x, row_y)) in px.chunks_exact_mut(stride).zip(py.chunks_exact_mut(stride)).enumerate() {
            let y = j as f64 * dy;
            sample_row(depth, dx, y, &mut depths);
            let coefficients = |k: usize| (model.h[(k, 0)], model.h[(k, 1)] * y + model.h[(k, 2)], model.e[k]);
            let [u, v, w] = [0, 1, 2].map(coefficients);
            let at = |(h, c, e): (f64, f64, f64), x: f64, d: f64| h * x + c + e * d;
            for (i, ((&d, px), py)) in depths.iter().zip(row_x).zip(row_y).enumerate() {
                let (x, d) = (i as f64 * dx, f64::from(d));
                let scale = 1.0 / at(w, x, d);
                let (mapped_x, mapped_y) = (at(u, x, d) * scale, at(v, x, d) * scale);
                // Not behind the camera, and not a hole, where all of these are NaN.
                let in_front = scale > 0.0;
                let visible = in_front && limits.contains(mapped_x, mapped_y);
                clipped |= in_front && !visible;
                if visible {
                    let (x, y) = (fixed(mapped_x), fixed(mapped_y));
                    (*px, *py) = (x, y);
                    least = [least[0].min(x), least[1].min(y)];
                    most = [most[0].max(x), most[1].max(y)];
                }
            }
        }
        if most[0] == INVALID {
            return Err(Error::NoOverlap { pixels: 0 }.into());
        }
        let bounds = [least[0], least[1], most[0], most[1]].map(|v| f64::from(v) / SUBPIXEL);
        Ok(Self { cells: [columns, rows], step: [dx, dy], x: px, y: py, stride, bounds, clipped })
    }

    /// Rows of cells with their corner points: the vertices of the row above and of the row below.
    pub fn cell_rows(&self) -> impl Iterator<Item = (Row<'_>, Row<'_>)> {
        self.rows().zip(self.rows().skip(1))
    }

    fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        let rows = self.x.chunks_exact(self.stride).zip(self.y.chunks_exact(self.stride));
        rows.map(|(x, y)| Row { x, y })
    }
}

/// One row of vertices.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    x: &'a [i32],
    y: &'a [i32],
}

impl Row<'_> {
    #[inline(always)]
    pub fn point(&self, column: usize) -> Point {
        [self.x[column], self.y[column]]
    }

    /// x and y of four vertices from `column` on.
    #[inline(always)]
    pub fn lanes(&self, column: usize) -> [i32x4; 2] {
        let four = |row: &[i32]| match row[column..].first_chunk::<LANES>() {
            Some(&lanes) => i32x4::new(lanes),
            None => i32x4::splat(INVALID),
        };
        [four(self.x), four(self.y)]
    }
}

/// Cells along one side and their length in pixels: one vertex per pixel, or `cells` equal steps between the first and
/// the last pixel.
fn axis(cells: u32, pixels: usize) -> (usize, f64) {
    let most = pixels.saturating_sub(1);
    let cells = if cells == 0 { most } else { most.min(cells as usize) };
    (cells, most as f64 / cells.max(1) as f64)
}

/// Inverse depth at the vertices of one row, `dx` apart: 0 without a map, as the model then has no parallax.
fn sample_row(depth: Option<&InverseDepth>, dx: f64, y: f64, out: &mut [f32]) {
    let Some(depth) = depth else { return };
    let row = (y as usize * depth.width())..((y as usize + 1) * depth.width());
    match depth.data().get(row) {
        Some(row) if row.len() == out.len() && y.fract() == 0.0 => out.copy_from_slice(row),
        _ => out.iter_mut().enumerate().for_each(|(i, out)| *out = depth.sample(i as f64 * dx, y) as f32),
    }
}

#[inline(always)]
fn fixed(v: f64) -> i32 {
    (v * SUBPIXEL + 0.5).floor() as i32
}
