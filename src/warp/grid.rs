//! Forward map of the target's grid vertices into the reference's view by equation 4 (paper, section 3.2.1).

use wide::{CmpEq, CmpGt, f64x2, i32x4};

use super::ProjectionSurface;
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
    pub surface: Option<ProjectionSurface>,
    /// Where the target ends within its frame; `None` where none of it is masked.
    pub outside: Option<&'a Mask>,
    pub limits: Limits,
}

/// Vertices of which all rows are kept, at most. More are mapped again whenever they are needed: that takes little of a warp's time,
/// but 8 bytes each a tenth of its memory.
pub(crate) const MOST_KEPT: usize = 1 << 22;

/// The mapped vertices of C₁×C₂ cells over the target.
pub(super) struct VertexGrid<'a> {
    mapping: Mapping<'a>,
    /// All rows, unless they are too many.
    kept: Option<Vertices>,
    /// Smallest and largest mapped x and y.
    pub bounds: [f64; 4],
    /// Whether a vertex lay beyond the canvas limit.
    pub clipped: bool,
}

impl<'a> VertexGrid<'a> {
    /// Maps all vertices. `no-overlap` when none lands on the canvas.
    pub fn map(
        size: (usize, usize),
        depth: Option<&'a InverseDepth>,
        map: &'a Map<'a>,
        cells: (u32, u32),
    ) -> Result<Self> {
        Self::keeping(MOST_KEPT, size, depth, map, cells)
    }

    /// As [`map`](Self::map), with so many vertices kept at most.
    fn keeping(
        most_kept: usize,
        size: (usize, usize),
        depth: Option<&'a InverseDepth>,
        map: &'a Map<'a>,
        (columns, rows): (u32, u32),
    ) -> Result<Self> {
        let ((columns, dx), (rows, dy)) = (axis(columns, size.0), axis(rows, size.1));
        // With a vertex at every pixel a photo that ends within its frame does so as at the frame; cells of a coarser grid are cut.
        let ends = map.outside.filter(|outside| outside.size() == (columns + 1, rows + 1));
        let mapping = Mapping { cells: [columns, rows], step: [dx, dy], depth, map, ends };
        let mut depths = mapping.depths()?;
        let keeps = mapping.stride() * (rows + 1) <= most_kept;
        let mut vertices = Vertices::new(mapping.stride(), if keeps { rows + 1 } else { 1 })?;
        let mut found = Found::NONE;
        for j in 0..=rows {
            mapping.map_row(j, &mut depths, vertices.row_mut(if keeps { j } else { 0 }), &mut found);
        }
        let (least, most) = (found.least.map(i32x4::reduce_min), found.most.map(i32x4::reduce_max));
        let clipped = found.clipped.move_mask() != 0;
        if most[0] == INVALID {
            return Err(Error::NoOverlap { pixels: 0 }.into());
        }
        let bounds = [least[0], least[1], most[0], most[1]].map(|v| f64::from(v) / SUBPIXEL);
        Ok(Self { mapping, kept: keeps.then_some(vertices), bounds, clipped })
    }

    /// Columns and rows of cells.
    pub fn cells(&self) -> [usize; 2] {
        self.mapping.cells
    }

    /// Width and height of a cell in target pixels: vertex (i, j) lies at (i, j) times this.
    pub fn step(&self) -> [f64; 2] {
        self.mapping.step
    }

    /// Rows of cells with their corner points: their index, the vertices of the row above and of the row below.
    pub fn for_each_row(&self, mut work: impl FnMut(usize, Row<'_>, Row<'_>) -> Result<()>) -> Result<()> {
        let [_, rows] = self.cells();
        let mut depths = self.mapping.depths()?;
        let mut two = Vertices::new(self.mapping.stride(), if self.kept.is_some() { 0 } else { 2 })?;
        for j in 0..=rows {
            if self.kept.is_none() {
                let mut known = Found::NONE;
                self.mapping.map_row(j, &mut depths, two.row_mut(j % 2), &mut known);
            }
            if let Some(above) = j.checked_sub(1) {
                match &self.kept {
                    Some(all) => work(above, all.row(above), all.row(j))?,
                    None => work(above, two.row(above % 2), two.row(j % 2))?,
                }
            }
        }
        Ok(())
    }
}

/// How vertices are mapped, row by row.
struct Mapping<'a> {
    cells: [usize; 2],
    step: [f64; 2],
    depth: Option<&'a InverseDepth>,
    map: &'a Map<'a>,
    /// Where the target ends, with a vertex at every pixel.
    ends: Option<&'a Mask>,
}

/// What is found out about all vertices while they are mapped.
struct Found {
    least: [i32x4; 2],
    most: [i32x4; 2],
    clipped: f64x2,
}

impl Found {
    const NONE: Self = Self { least: [i32x4::MAX; 2], most: [i32x4::new([INVALID; LANES]); 2], clipped: f64x2::ZERO };
}

impl Mapping<'_> {
    /// Vertices of a row, with those that fill it up.
    fn stride(&self) -> usize {
        self.cells[0].next_multiple_of(LANES) + LANES
    }

    /// Room for the depth of a row. Beyond the last vertex are holes.
    fn depths(&self) -> Result<Vec<f32>> {
        let mut depths = filled(self.stride(), f32::NAN)?;
        depths[..=self.cells[0]].fill(0.0);
        Ok(depths)
    }

    /// Maps row `j`.
    fn map_row(&self, j: usize, depths: &mut [f32], (row_x, row_y): (&mut [i32], &mut [i32]), found: &mut Found) {
        let (Self { depth, map, .. }, columns, [dx, dy]) = (self, self.cells[0], self.step);
        let none = i32x4::splat(INVALID);
        let Found { mut least, mut most, mut clipped } = *found;
        let y = j as f64 * dy;
        sample_row(*depth, dx, y, &mut depths[..=columns]);
        if let Some(outside) = self.ends {
            if depth.is_none() {
                depths[..=columns].fill(0.0);
            }
            let row = depths.iter_mut().zip(&outside.data()[j * (columns + 1)..]).take(columns + 1);
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
        *found = Found { least, most, clipped };
    }
}

/// Mapped x and y in reference pixels of rows of vertices, which are filled up with [`INVALID`] to `stride`.
struct Vertices {
    x: Vec<i32>,
    y: Vec<i32>,
    stride: usize,
}

impl Vertices {
    fn new(stride: usize, rows: usize) -> Result<Self> {
        Ok(Self { x: zeroed(stride * rows)?, y: zeroed(stride * rows)?, stride })
    }

    fn row(&self, j: usize) -> Row<'_> {
        let row = j * self.stride..(j + 1) * self.stride;
        Row { x: &self.x[row.clone()], y: &self.y[row] }
    }

    fn row_mut(&mut self, j: usize) -> (&mut [i32], &mut [i32]) {
        let row = j * self.stride..(j + 1) * self.stride;
        (&mut self.x[row.clone()], &mut self.y[row])
    }
}

/// The map along a row of the target: the homogeneous coordinates are h x + c + e d each.
struct RowProjection<'a> {
    terms: [[f64x2; 3]; 3],
    surface: Option<&'a ProjectionSurface>,
}

impl<'a> RowProjection<'a> {
    #[inline(always)]
    fn new(map: &'a Map<'_>, y: f64) -> Self {
        let Model { h, e } = map.model;
        let terms = [0, 1, 2].map(|k| [h[(k, 0)], h[(k, 1)] * y + h[(k, 2)], e[k]].map(f64x2::splat));
        Self { terms, surface: map.surface.as_ref() }
    }

    /// Images of two points, and which of them are neither behind the camera nor a hole, where all is NaN.
    #[inline(always)]
    fn project(&self, x: f64x2, d: f64x2) -> ([f64x2; 2], f64x2) {
        let [u, v, w] = self.terms.map(|[h, c, e]| h * x + c + e * d);
        if let Some(surface) = self.surface {
            return Self::around(surface, [u, v, w]);
        }
        let scale = f64x2::splat(1.0) / w;
        ([u * scale, v * scale], scale.cmp_gt(f64x2::splat(0.0)))
    }

    /// Images of two rays.
    fn around(surface: &ProjectionSurface, rays: [f64x2; 3]) -> ([f64x2; 2], f64x2) {
        let [[x0, x1], [y0, y1], [z0, z1]] = rays.map(f64x2::to_array);
        let ([u0, v0], [u1, v1]) = (surface.project([x0, y0, z0]), surface.project([x1, y1, z1]));
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::Image;
    use crate::inverse_depth::DepthKind;

    #[test]
    fn rows_are_the_same_whether_they_are_kept_or_not() {
        let size = (37, 23);
        let values: Vec<f32> = (0..37 * 23).map(|i| ((i * 7) % 31) as f32 / 31.0).collect();
        let depth = InverseDepth::new("depth", &values, size, DepthKind::Inverse, Some(0.0), size).unwrap();
        let model =
            Model { h: Matrix3::new(1.0, 0.1, -3.0, -0.05, 0.9, 2.0, 1e-4, 0.0, 1.0), e: Vector3::new(9.0, 1.0, 0.0) };
        let mut outside = Mask::empty(37, 23).unwrap();
        outside.data_mut()[30..37].fill(255);
        let reference = Image::transparent(40, 30).unwrap();
        for (outside, cells) in [(None, (0, 0)), (Some(&outside), (0, 0)), (None, (9, 5))] {
            let map = Map { model: &model, surface: None, outside, limits: Limits::new(reference.size(), 0.1) };
            let rows = |most_kept| {
                let grid = VertexGrid::keeping(most_kept, size, Some(&depth), &map, cells).unwrap();
                let mut rows = Vec::new();
                grid.for_each_row(|j, above, below| {
                    rows.push((j, [above.x, above.y, below.x, below.y].map(<[i32]>::to_vec)));
                    Ok(())
                })
                .unwrap();
                (rows, grid.bounds, grid.clipped)
            };
            assert_eq!(rows(0), rows(usize::MAX));
        }
    }
}
