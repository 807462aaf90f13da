//! Forward map of the target's grid vertices into the reference's view by equation 4 (paper, section 3.2.1).

use wide::{CmpEq, CmpGt, f64x2, i32x4};

use super::Screen;
use super::canvas::Limits;
use crate::geometry::Model;
use crate::image::{filled, zeroed};
use crate::lanes::LANES;
use crate::{Error, InverseDepth, Mask, Result};

/// Binary digits after the point of a [`Point`]. On this grid edge functions are exact in integers, so neighbouring
/// cells meet without gap or overlap.
pub(super) const SUBPIXEL_BITS: u32 = 10;
/// One pixel in fixed point.
pub(super) const PIXEL: i32 = 1 << SUBPIXEL_BITS;
const SUBPIXEL: f64 = PIXEL as f64;

/// A mapped position in fixed point; both are [`INVALID`] for a vertex behind the camera, at a hole, where the photo has ended or
/// beyond the canvas limit.
pub(super) type Point = [i32; 2];
pub(super) const INVALID: i32 = i32::MIN;

/// Where the target's pixels land.
pub(super) struct Map<'a> {
    pub model: &'a Model,
    /// What the model's image is projected onto, other than a plane.
    pub screen: Option<Screen>,
    /// Where the target ends within its frame; `None` where all of it is there.
    pub outside: Option<&'a Mask>,
    pub limits: Limits,
}

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
        map: &Map<'_>,
        (columns, rows): (u32, u32),
    ) -> Result<Self> {
        let ((columns, dx), (rows, dy)) = (axis(columns, size.0), axis(rows, size.1));
        let stride = columns.next_multiple_of(LANES) + LANES;
        let mut px: Vec<i32> = zeroed(stride * (rows + 1))?;
        let mut py: Vec<i32> = zeroed(stride * (rows + 1))?;
        let none = i32x4::splat(INVALID);
        let (mut clipped, mut least, mut most) = (f64x2::splat(0.0), [i32x4::splat(i32::MAX); 2], [none; 2]);
        // With a vertex at every pixel a photo that ends within its frame does so as at the frame; cells of a coarser grid are cut.
        let ends = map.outside.filter(|outside| outside.size() == (columns + 1, rows + 1));
        // Beyond the last vertex are holes.
        let mut depths = filled(stride, f32::NAN)?;
        depths[..=columns].fill(0.0);
        for (j, (row_x, row_y)) in px.chunks_exact_mut(stride).zip(py.chunks_exact_mut(stride)).enumerate() {
            let y = j as f64 * dy;
            sample_row(depth, dx, y, &mut depths[..=columns]);
            if let Some(outside) = ends {
                if depth.is_none() {
                    depths[..=columns].fill(0.0);
                }
                let row = depths.iter_mut().zip(&outside.data()[j * size.0..]).take(size.0);
                row.filter(|(_, outside)| **outside != 0).for_each(|(depth, _)| *depth = f32::NAN);
            }
            let projection = RowProjection::new(map, y);
            // Vertices i and i + 1.
            let mut land = |i: usize, d: [f32; 2]| {
                let x = f64x2::new([i as f64, (i + 1) as f64]) * f64x2::splat(dx);
                let d = f64x2::new([f64::from(d[0]), f64::from(d[1])]);
                let ([x, y], in_front) = projection.project(x, d);
                let visible = in_front & map.limits.contain([x, y]);
                clipped |= in_front ^ visible;
                [fixed(x), fixed(y), bytemuck::cast(visible)]
            };
            let vertices = row_x.as_chunks_mut::<LANES>().0.iter_mut().zip(row_y.as_chunks_mut::<LANES>().0);
            for (i, (&[a, b, c, d], (px, py))) in depths.as_chunks::<LANES>().0.iter().zip(vertices).enumerate() {
                let (two, others) = (land(LANES * i, [a, b]), land(LANES * i + 2, [c, d]));
                let [x, y, visible] = [0, 1, 2].map(|k| even_lanes(two[k], others[k]));
                for (k, (v, out)) in [x, y].into_iter().zip([px, py]).enumerate() {
                    least[k] = least[k].min(visible.blend(v, least[k]));
                    let v = visible.blend(v, none);
                    most[k] = most[k].max(v);
                    *out = v.to_array();
                }
            }
        }
        let (least, most) = (least.map(i32x4::reduce_min), most.map(i32x4::reduce_max));
        let clipped = clipped.move_mask() != 0;
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

/// The map along a row of the target: the homogeneous coordinates are h x + c + e d each.
struct RowProjection<'a> {
    terms: [[f64x2; 3]; 3],
    screen: Option<&'a Screen>,
}

impl<'a> RowProjection<'a> {
    #[inline(always)]
    fn new(map: &'a Map<'_>, y: f64) -> Self {
        let Model { h, e } = map.model;
        let terms = [0, 1, 2].map(|k| [h[(k, 0)], h[(k, 1)] * y + h[(k, 2)], e[k]].map(f64x2::splat));
        Self { terms, screen: map.screen.as_ref() }
    }

    /// Images of two points, and which of them are neither behind the camera nor a hole, where all is NaN.
    #[inline(always)]
    fn project(&self, x: f64x2, d: f64x2) -> ([f64x2; 2], f64x2) {
        let [u, v, w] = self.terms.map(|[h, c, e]| h * x + c + e * d);
        if let Some(screen) = self.screen {
            return Self::around(screen, [u, v, w]);
        }
        let scale = f64x2::splat(1.0) / w;
        ([u * scale, v * scale], scale.cmp_gt(f64x2::splat(0.0)))
    }

    /// Images of two rays.
    fn around(screen: &Screen, rays: [f64x2; 3]) -> ([f64x2; 2], f64x2) {
        let [[x0, x1], [y0, y1], [z0, z1]] = rays.map(f64x2::to_array);
        let ([u0, v0], [u1, v1]) = (screen.project([x0, y0, z0]), screen.project([x1, y1, z1]));
        let v = f64x2::new([v0, v1]);
        ([f64x2::new([u0, u1]), v], v.cmp_eq(v))
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

    /// x and y of four vertices from `column` on, and of the ones to the right of them.
    #[inline(always)]
    pub fn lanes(&self, column: usize) -> [[i32x4; 2]; 2] {
        let four = |row: &[i32]| match (row.first_chunk(), row.last_chunk()) {
            (Some(&left), Some(&right)) => [left, right].map(i32x4::new),
            _ => [i32x4::splat(INVALID); 2],
        };
        let of = |row: &[i32]| four(&row[column..column + LANES + 1]);
        let ([x, right_x], [y, right_y]) = (of(self.x), of(self.y));
        [[x, y], [right_x, right_y]]
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

/// Rounded to fixed point, ½ up, in the even lanes; the others mean nothing.
#[inline(always)]
fn fixed(v: f64x2) -> i32x4 {
    // The last digit of numbers about this large counts ones.
    const ONES: f64x2 = f64x2::new([1.5 * (1u64 << 52) as f64; 2]);
    let v = (v * f64x2::splat(SUBPIXEL) + f64x2::splat(0.5))
        .fast_max(f64x2::splat(f64::from(i32::MIN)))
        .fast_min(f64x2::splat(f64::from(i32::MAX)));
    let nearest = v + ONES;
    let above = (nearest - ONES).cmp_gt(v);
    bytemuck::cast::<_, i32x4>(nearest) + bytemuck::cast::<_, i32x4>(above)
}

#[inline(always)]
fn even_lanes(p: i32x4, q: i32x4) -> i32x4 {
    let (p, q) = (p.to_array(), q.to_array());
    i32x4::new([p[0], p[2], q[0], q[2]])
}
