//! Backward rendering with void recovery and overlapped-pixel selection (paper, section 3.2, algorithm 2).

use super::canvas::Canvas;
use super::grid::{Point, VertexGrid, is_valid, sides};
use super::raster::{Cell, pixel_range};
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

/// Draws every cell of the grid into `image` and `footprint`, which are empty and of the canvas' size.
pub(super) fn render(
    scene: &Scene<'_>,
    grid: &VertexGrid,
    canvas: &Canvas,
    image: &mut Image,
    footprint: &mut Mask,
    observer: &mut dyn Observer,
) -> Result<()> {
    let mut painter = Painter::new(scene, grid, canvas, image, footprint)?;
    let rows = grid.ys.len().saturating_sub(1);
    for (j, (above, below)) in grid.cell_rows().enumerate() {
        if j % 64 == 0 {
            report(observer, Stage::Warp, 0.2 + 0.8 * j as f32 / rows as f32)?;
        }
        let (y0, dy) = (grid.ys[j], grid.ys[j + 1] - grid.ys[j]);
        for (i, (top, bottom)) in above.windows(2).zip(below.windows(2)).enumerate() {
            let corners = [top[0], top[1], bottom[1], bottom[0]];
            if !is_valid(corners) {
                continue;
            }
            let ((x_first, x_last), (y_first, y_last)) = (pixel_range(&corners, 0), pixel_range(&corners, 1));
            if x_first > x_last || y_first > y_last {
                continue;
            }
            let Some(cell) = Cell::new(corners) else { continue };
            let border = [i + 2 == grid.xs.len(), j + 2 == grid.ys.len()];
            let (x0, dx) = (grid.xs[i], grid.xs[i + 1] - grid.xs[i]);
            for y in y_first..=y_last {
                for x in x_first..=x_last {
                    if let Some([u, v]) = cell.locate(x, y, border) {
                        painter.offer(x, y, [x0 + f64::from(u) * dx, y0 + f64::from(v) * dy], &corners);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Decides which candidates become pixels.
struct Painter<'a> {
    scene: &'a Scene<'a>,
    canvas: &'a Canvas,
    image: &'a mut Image,
    footprint: &'a mut Mask,
    /// Smallest wins: squared photometric error inside the reference, minus inverse depth outside. Empty without
    /// selection.
    keys: Vec<f32>,
    recover: bool,
    select: bool,
    /// β², in squared pixels of the target.
    beta2: f64,
    /// Longest horizontal and vertical side of a cell that is no void.
    longest: [f32; 2],
}

impl<'a> Painter<'a> {
    fn new(
        scene: &'a Scene<'a>,
        grid: &VertexGrid,
        canvas: &'a Canvas,
        image: &'a mut Image,
        footprint: &'a mut Mask,
    ) -> Result<Self> {
        let options = scene.options;
        let recover = options.mode != WarpMode::Backward;
        let select = options.mode == WarpMode::Optimal;
        let (w, h) = (scene.target.width() as f64, scene.target.height() as f64);
        Ok(Self {
            scene,
            canvas,
            image,
            footprint,
            keys: if select { zeroed(canvas.width * canvas.height)? } else { Vec::new() },
            recover,
            select,
            beta2: options.void_distance * options.void_distance * (w * w + h * h),
            longest: grid.mean_sides().map(|side| (side * options.stretch_limit) as f32),
        })
    }

    /// Offers target position `s` for reference pixel (x, y), from the cell with the given corners.
    #[inline(always)]
    fn offer(&mut self, x: i32, y: i32, s: [f64; 2], corners: &[Point; 4]) {
        let (offset_x, offset_y) = self.canvas.offset;
        let at = (y + offset_y as i32) as usize * self.canvas.width + (x + offset_x as i32) as usize;
        self.footprint.data[at] = 255;
        let taken = self.image.data[4 * at + 3] != 0;
        if taken && !self.select {
            return;
        }
        let scene = self.scene;
        // Negative coordinates turn into huge ones and fail the test as well.
        let (rx, ry) = (x as u32 as usize, y as u32 as usize);
        let (colour, key);
        if rx < scene.reference.width() && ry < scene.reference.height() {
            let index = ry * scene.reference.width() + rx;
            if self.recover && !self.confirmed([x, y], index, s) {
                return;
            }
            colour = bilinear(&scene.target, s);
            key = photometric_error(&scene.reference, index, colour);
            if self.select && taken && key >= self.keys[at] {
                return;
            }
        } else {
            if self.recover && self.stretched(corners) {
                return;
            }
            key = if self.select {
                -scene.target_depth.map_or(0.0, |depth| depth.sample(s[0], s[1]) as f32)
            } else {
                0.0
            };
            if self.select && taken && key >= self.keys[at] {
                return;
            }
            colour = bilinear(&scene.target, s);
        }
        if self.select {
            self.keys[at] = key;
        }
        let [r, g, b] = [0, 1, 2].map(|k| (colour[k] + 0.5) as u8);
        self.image.data[4 * at..4 * at + 4].copy_from_slice(&[r, g, b, 255]);
    }

    /// Whether the reverse model sends the reference pixel to within β of s (paper, equation 9). Multiplied out by
    /// the third coordinate, which spares the division.
    #[inline(always)]
    fn confirmed(&self, pixel: [i32; 2], index: usize, s: [f64; 2]) -> bool {
        let d = self.scene.reference_depth.map_or(0.0, |depth| f64::from(depth.data()[index]));
        let [u, v, w] = self.scene.reverse.transform(f64::from(pixel[0]), f64::from(pixel[1]), d);
        let (x, y) = (u - s[0] * w, v - s[1] * w);
        w > 0.0 && x * x + y * y < self.beta2 * w * w
    }

    /// Outside the reference a cell is void when its mean horizontal or vertical side is too long. (The paper's text
    /// and the authors' program agree on "or"; its algorithm 2 says the opposite.)
    #[inline(always)]
    fn stretched(&self, corners: &[Point; 4]) -> bool {
        let [h, v] = sides(*corners);
        h > self.longest[0] || v > self.longest[1]
    }
}

/// ‖I_r(s') − I_t(s)‖² over RGB.
#[inline(always)]
fn photometric_error(reference: &ImageView<'_>, index: usize, colour: [f32; 4]) -> f32 {
    let pixel = &reference.data()[4 * index..4 * index + 4];
    let [r, g, b] = [0, 1, 2].map(|k| colour[k] - f32::from(pixel[k]));
    r * r + g * g + b * b
}
