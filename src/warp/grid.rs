//! Forward map of the target's grid vertices into the reference's view (paper, section 3.2.1).

use super::canvas::Limits;
use crate::geometry::Model;
use crate::image::{reserve, zeroed};
use crate::{Error, InverseDepth, Result};

/// Binary digits after the point of a [`Point`]. On this grid edge functions are exact in integers, so neighbouring
/// cells meet without gap or overlap.
pub(super) const SUBPIXEL_BITS: u32 = 10;
const SUBPIXEL: f64 = (1 << SUBPIXEL_BITS) as f64;

/// A mapped position in fixed point; x is [`INVALID`] for a vertex behind the camera, at a hole or beyond the canvas
/// limit.
pub(super) type Point = [i32; 2];
pub(super) const INVALID: i32 = i32::MIN;

/// The mapped vertices of C₁×C₂ cells over the target.
pub(super) struct VertexGrid {
    /// Target x of each column of vertices.
    pub xs: Vec<f64>,
    /// Target y of each row of vertices.
    pub ys: Vec<f64>,
    /// Mapped positions, row by row, in reference pixels.
    pub points: Vec<Point>,
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
        let (xs, ys) = (axis(columns, size.0)?, axis(rows, size.1)?);
        let mut points = Vec::new();
        reserve(&mut points, xs.len() * ys.len())?;
        let mut clipped = false;
        let mut depths: Vec<f32> = zeroed(xs.len())?;
        for &y in &ys {
            sample_row(depth, &xs, y, &mut depths);
            let column = |k: usize| (model.h[(k, 0)], model.h[(k, 1)] * y + model.h[(k, 2)], model.e[k]);
            let ([u, v, w], at) =
                ([column(0), column(1), column(2)], |(h, c, e): (f64, f64, f64), x, d| h * x + c + e * d);
            points.extend(xs.iter().zip(&depths).map(|(&x, &d)| {
                let d = f64::from(d);
                let scale = 1.0 / at(w, x, d);
                let (px, py) = (at(u, x, d) * scale, at(v, x, d) * scale);
                // Behind the camera, or a hole.
                if scale <= 0.0 || scale.is_nan() {
                    [INVALID; 2]
                } else if limits.contains(px, py) {
                    [fixed(px), fixed(py)]
                } else {
                    clipped = true;
                    [INVALID; 2]
                }
            }));
        }
        let bounds = bounds(&points)?;
        Ok(Self { xs, ys, points, bounds, clipped })
    }

    /// Rows of cells with their corner points: the vertices of the row above and of the row below.
    pub fn cell_rows(&self) -> impl Iterator<Item = (&[Point], &[Point])> {
        let n = self.xs.len();
        self.points.chunks_exact(n).zip(self.points.chunks_exact(n).skip(1))
    }

    /// Mean horizontal and mean vertical side over all valid cells, in pixels.
    pub fn mean_sides(&self) -> [f64; 2] {
        let (mut sum, mut cells) = ([0.0; 2], 0u64);
        for (above, below) in self.cell_rows() {
            let mut row = [0.0f32; 2];
            for (a, b) in above.windows(2).zip(below.windows(2)) {
                let corners = [a[0], a[1], b[1], b[0]];
                if is_valid(corners) {
                    let [h, v] = sides(corners);
                    row = [row[0] + h, row[1] + v];
                    cells += 1;
                }
            }
            sum = [sum[0] + f64::from(row[0]), sum[1] + f64::from(row[1])];
        }
        sum.map(|s| s / cells.max(1) as f64)
    }
}

/// Whether all corners of a cell are.
#[inline(always)]
fn is_valid(corners: [Point; 4]) -> bool {
    corners.iter().all(|corner| corner[0] != INVALID)
}

/// Mean horizontal and mean vertical side, in pixels, of a valid cell with corners in turn from the top left.
#[inline]
pub(super) fn sides(c: [Point; 4]) -> [f32; 2] {
    let length = |a: Point, b: Point| {
        let (x, y) = ((b[0] - a[0]) as f32, (b[1] - a[1]) as f32);
        (x * x + y * y).sqrt()
    };
    let half = 0.5 / SUBPIXEL as f32;
    [half * (length(c[0], c[1]) + length(c[3], c[2])), half * (length(c[0], c[3]) + length(c[1], c[2]))]
}

/// Vertex positions along one side: every pixel, or `cells` equal steps between the first and the last pixel.
fn axis(cells: u32, pixels: usize) -> Result<Vec<f64>> {
    let most = pixels.saturating_sub(1);
    let cells = if cells == 0 { most } else { most.min(cells as usize) };
    let mut out = Vec::new();
    reserve(&mut out, cells + 1)?;
    out.extend((0..=cells).map(|i| i as f64 * most as f64 / cells.max(1) as f64));
    Ok(out)
}

/// Inverse depth at the vertices of one row: 0 without a map, as the model then has no parallax.
fn sample_row(depth: Option<&InverseDepth>, xs: &[f64], y: f64, out: &mut [f32]) {
    let Some(depth) = depth else { return };
    let row = (y as usize * depth.width())..((y as usize + 1) * depth.width());
    match depth.data().get(row) {
        Some(row) if row.len() == xs.len() && y.fract() == 0.0 => out.copy_from_slice(row),
        _ => out.iter_mut().zip(xs).for_each(|(out, &x)| *out = depth.sample(x, y) as f32),
    }
}

fn bounds(points: &[Point]) -> Result<[f64; 4]> {
    let mut b = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
    for p in points.iter().filter(|p| p[0] != INVALID) {
        b = [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])];
    }
    if b[0] > b[2] {
        return Err(Error::NoOverlap { pixels: 0 });
    }
    Ok(b.map(|v| f64::from(v) / SUBPIXEL))
}

#[inline(always)]
fn fixed(v: f64) -> i32 {
    (v * SUBPIXEL + 0.5).floor() as i32
}
