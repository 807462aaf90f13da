//! Backward rendering with void recovery and overlapped-pixel selection (paper, section 3.2, algorithm 2).

use super::canvas::Canvas;
use super::grid::{VertexGrid, sides};
use super::raster::Cell;
use super::sample::bilinear;
use super::{WarpMode, WarpOptions};
use crate::geometry::Model;
use crate::image::zeroed;
use crate::observer::{Observer, report};
use crate::{Image, ImageView, InverseDepth, Mask, Result, Stage};

/// Everything the choice between candidates looks at.
pub(super) struct Scene<'a> {
    pub target: ImageView<'a>,
    pub target_depth: Option<&'a InverseDepth>,
    pub reference: ImageView<'a>,
    pub reference_depth: Option<&'a InverseDepth>,
    pub reverse: &'a Model,
    pub options: &'a WarpOptions,
}

impl Scene<'_> {
    /// Where the reverse model sends reference pixel (x, y), `None` when it says nothing.
    #[inline(always)]
    fn trace_back(&self, x: usize, y: usize, index: usize) -> Option<[f64; 2]> {
        let d = match self.reference_depth {
            Some(depth) => f64::from(depth.data()[index]),
            None => 0.0,
        };
        self.reverse.project(x as f64, y as f64, d)
    }

    /// Squared photometric error ‖I_r(s') − I_t(s)‖² over RGB.
    #[inline(always)]
    fn photometric_error(&self, index: usize, colour: [f32; 4]) -> f32 {
        let reference = &self.reference.data()[4 * index..4 * index + 4];
        let mut sum = 0.0;
        for k in 0..3 {
            let diff = colour[k] - f32::from(reference[k]);
            sum += diff * diff;
        }
        sum
    }

    fn nearness(&self, s: [f64; 2]) -> f32 {
        self.target_depth.map_or(0.0, |depth| depth.sample(s[0], s[1]) as f32)
    }
}

/// Draws every cell of the grid into `out` and `footprint`, which are empty and of the canvas' size.
pub(super) fn render(
    scene: &Scene<'_>,
    grid: &VertexGrid,
    canvas: &Canvas,
    out: &mut Image,
    footprint: &mut Mask,
    observer: &mut dyn Observer,
) -> Result<()> {
    let options = scene.options;
    let recover = options.mode != WarpMode::Backward;
    let select = options.mode == WarpMode::Optimal;
    let (w, h) = (scene.target.width() as f64, scene.target.height() as f64);
    let beta2 = options.void_distance * options.void_distance * (w * w + h * h);
    let longest = grid.mean_side.map(|side| (side * options.stretch_limit) as f32);
    let offset = [canvas.offset.0 as f64, canvas.offset.1 as f64];
    // Smallest key wins: photometric error inside the reference, minus inverse depth outside.
    let mut keys: Vec<f32> = if select { zeroed(canvas.width * canvas.height)? } else { Vec::new() };
    let rows = grid.ys.len().saturating_sub(1);
    for (j, (above, below)) in grid.cell_rows().enumerate() {
        if j % 64 == 0 {
            report(observer, Stage::Warp, 0.2 + 0.8 * j as f32 / rows as f32)?;
        }
        let (y0, dy) = (grid.ys[j], grid.ys[j + 1] - grid.ys[j]);
        for (i, (top, bottom)) in above.windows(2).zip(below.windows(2)).enumerate() {
            let points = [top[0], top[1], bottom[1], bottom[0]];
            if points.iter().any(|p| p[0].is_nan()) {
                continue;
            }
            let corners = points.map(|p| [f64::from(p[0]) + offset[0], f64::from(p[1]) + offset[1]]);
            let Some(cell) = Cell::new(corners) else { continue };
            let border = [i + 2 == grid.xs.len(), j + 2 == grid.ys.len()];
            let (x0, dx) = (grid.xs[i], grid.xs[i + 1] - grid.xs[i]);
            let min = |k: usize| corners.iter().fold(f64::INFINITY, |m, c| m.min(c[k])).ceil() as usize;
            let max = |k: usize| corners.iter().fold(0.0, |m: f64, c| m.max(c[k])) as usize;
            for y in min(1)..=max(1) {
                for x in min(0)..=max(0) {
                    let Some([u, v]) = cell.locate([x as f64, y as f64], border) else { continue };
                    let at = y * canvas.width + x;
                    footprint.data[at] = 255;
                    let s = [x0 + u * dx, y0 + v * dy];
                    let taken = out.data[4 * at + 3] != 0;
                    if taken && !select {
                        continue;
                    }
                    let (colour, key);
                    if let Some(index) = canvas.reference_index(x, y) {
                        if recover {
                            let back = scene.trace_back(x - canvas.offset.0, y - canvas.offset.1, index);
                            let Some([bx, by]) = back else { continue };
                            if (bx - s[0]) * (bx - s[0]) + (by - s[1]) * (by - s[1]) >= beta2 {
                                continue;
                            }
                        }
                        colour = bilinear(&scene.target, s[0] as f32, s[1] as f32);
                        key = scene.photometric_error(index, colour);
                    } else {
                        if recover && stretched(points, longest) {
                            continue;
                        }
                        key = if select { -scene.nearness(s) } else { 0.0 };
                        if taken && key >= keys[at] {
                            continue;
                        }
                        colour = bilinear(&scene.target, s[0] as f32, s[1] as f32);
                    }
                    if select {
                        if taken && key >= keys[at] {
                            continue;
                        }
                        keys[at] = key;
                    }
                    let pixel = &mut out.data[4 * at..4 * at + 4];
                    for k in 0..3 {
                        pixel[k] = (colour[k] + 0.5) as u8;
                    }
                    pixel[3] = 255;
                }
            }
        }
    }
    Ok(())
}

/// Outside the reference a cell is void when its mean horizontal or vertical side is too long. (The paper's text and
/// the authors' program agree on "or"; its algorithm 2 says the opposite.)
#[inline]
fn stretched(points: [[f32; 2]; 4], longest: [f32; 2]) -> bool {
    let [h, v] = sides(points);
    h > longest[0] || v > longest[1]
}
