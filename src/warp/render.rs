//! Backward rendering with void recovery and overlapped-pixel selection (paper, section 3.2, algorithm 2).

use super::canvas::Canvas;
use super::grid::{Point, VertexGrid, sides};
use super::raster::Rasteriser;
use super::sample::Tap;
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
    let (columns, rows) = (grid.xs.len().saturating_sub(1), grid.ys.len().saturating_sub(1));
    let mut rasteriser = Rasteriser::new(columns)?;
    for (j, (above, below)) in grid.cell_rows().enumerate() {
        if j % 64 == 0 {
            report(observer, Stage::Warp, 0.2 + 0.8 * j as f32 / rows as f32)?;
        }
        let (y0, dy) = (grid.ys[j], grid.ys[j + 1] - grid.ys[j]);
        rasteriser.draw_row(above, below, j + 1 == rows, |i, corners, x, y, u, v| {
            let (x0, dx) = (grid.xs[i], grid.xs[i + 1] - grid.xs[i]);
            painter.offer(x, y, [x0 + f64::from(u) * dx, y0 + f64::from(v) * dy], corners);
        });
    }
    Ok(())
}

/// Decides which candidates become pixels.
struct Painter<'a> {
    scene: &'a Scene<'a>,
    canvas: &'a Canvas,
    pixels: &'a mut [[u8; 4]],
    footprint: &'a mut [u8],
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
            pixels: image.data.as_chunks_mut().0,
            footprint: &mut footprint.data,
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
        self.footprint[at] = 255;
        let taken = self.pixels[at][3] != 0;
        if taken && !self.select {
            return;
        }
        let scene = self.scene;
        let (width, height) = (scene.reference.width(), scene.reference.height());
        // Negative coordinates turn into huge ones and fail the test as well.
        let (rx, ry) = (x as u32 as usize, y as u32 as usize);
        let inside = rx < width && ry < height;
        let index = if inside { ry * width + rx } else { 0 };
        let kept = !self.recover || if inside { self.confirmed([x, y], index, s) } else { !self.stretched(corners) };
        if !kept {
            return;
        }
        let tap = Tap::new(s, (scene.target.width(), scene.target.height()));
        let colour = tap.colour(&scene.target);
        if self.select {
            let key = match (inside, scene.target_depth) {
                (true, _) => photometric_error(scene.reference.pixels()[index], colour),
                (false, Some(depth)) => -tap.value(depth.data()),
                (false, None) => 0.0,
            };
            if taken && key >= self.keys[at] {
                return;
            }
            self.keys[at] = key;
        }
        self.pixels[at] = [colour[0], colour[1], colour[2], 255];
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
fn photometric_error(reference: [u8; 4], colour: [u8; 4]) -> f32 {
    let [r, g, b] = [0, 1, 2].map(|k| i32::from(colour[k]) - i32::from(reference[k]));
    (r * r + g * g + b * b) as f32
}
