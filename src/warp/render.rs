//! Backward rendering with void recovery and overlapped-pixel selection (paper, section 3.2, algorithm 2).

use super::canvas::Canvas;
use super::difference;
use super::grid::VertexGrid;
use super::raster::{BATCH, Covered, LANES, draw_row};
use super::sample::Tap;
use super::sides::StretchLimit;
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

/// Draws every cell of the grid into `image` and `footprint`, which are empty and of the canvas' size. Returns the
/// target's own inverse depth at every pixel that shows it, if that is wanted, anything elsewhere; empty without a map.
pub(super) fn render(
    scene: &Scene<'_>,
    grid: &VertexGrid,
    canvas: &Canvas,
    image: &mut Image,
    footprint: &mut Mask,
    observer: &mut dyn Observer,
) -> Result<Vec<f32>> {
    let mut painter = Painter::new(scene, canvas, image, footprint)?;
    let stretch = StretchLimit::new(grid, scene.options.stretch_limit);
    let [columns, rows] = grid.cells;
    let mut buffer = [Covered::default(); BATCH];
    for (j, (above, below)) in grid.cell_rows().enumerate() {
        if j % 64 == 0 {
            report(observer, Stage::Warp, 0.2 + 0.8 * j as f32 / rows as f32)?;
        }
        draw_row(above, below, columns, j + 1 == rows, &stretch, &mut buffer, |groups| {
            painter.offer(groups, j, grid.step);
        });
    }
    Ok(painter.finish())
}

const COVERED: u8 = 1;
const TAKEN: u8 = 255;

/// Decides which candidates become pixels.
struct Painter<'a> {
    scene: &'a Scene<'a>,
    canvas: &'a Canvas,
    pixels: &'a mut [[u8; 4]],
    /// [`COVERED`] where a candidate was offered, [`TAKEN`] where one was accepted. Ends as the footprint.
    state: &'a mut [u8],
    /// The target's inverse depth of the accepted candidate. Empty without a map.
    depth: Vec<f32>,
    /// 1/3σ²: σ is the colour distance where the photos are alike, and more where they differ anyway.
    per_colour: f64,
}

impl<'a> Painter<'a> {
    fn new(scene: &'a Scene<'a>, canvas: &'a Canvas, image: &'a mut Image, footprint: &'a mut Mask) -> Result<Self> {
        let distance = scene.options.colour_distance;
        Ok(Self {
            scene,
            canvas,
            pixels: image.data.as_chunks_mut().0,
            state: &mut footprint.data,
            depth: zeroed(scene.target_depth.map_or(0, |_| canvas.width * canvas.height))?,
            per_colour: 1.0 / (3.0 * distance * distance + 0.19 * difference::mean(scene)),
        })
    }

    /// Offers the pixels covered by cells of row `j`, which are `step` target pixels wide and high.
    #[inline(always)]
    fn offer(&mut self, groups: &[Covered], j: usize, step: [f64; 2]) {
        // What the loop looks at lies in locals: nothing that is written could change it.
        let Scene { target, target_depth, reference, reference_depth, reverse, .. } = *self.scene;
        let options = self.scene.options;
        let recover = options.mode != WarpMode::Backward;
        let select = options.mode == WarpMode::Optimal;
        let (w, h) = (target.width() as f64, target.height() as f64);
        // 1/β², β in pixels of the target.
        let per_place = 1.0 / (options.void_distance * options.void_distance * (w * w + h * h));
        let per_colour = self.per_colour;
        let (offset_x, offset_y) = self.canvas.offset;
        let (stride, width, height) = (self.canvas.width, reference.width(), reference.height());
        let state = &mut *self.state;
        let pixels = &mut self.pixels[..state.len()];
        let depths = &mut self.depth[..];
        let (photo, photo_depth) = (reference.pixels(), reference_depth.map(InverseDepth::data));
        for group in groups {
            let mut lanes = group.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % LANES;
                lanes &= lanes - 1;
                let (x, y) = (group.x.as_array_ref()[lane], group.y.as_array_ref()[lane]);
                let at = (y + offset_y as i32) as usize * stride + (x + offset_x as i32) as usize;
                let taken = state[at] == TAKEN;
                if taken && !select {
                    continue;
                }
                if !taken {
                    state[at] = COVERED;
                }
                // Negative coordinates turn into huge ones and fail the test as well.
                let (rx, ry) = (x as u32 as usize, y as u32 as usize);
                let inside = rx < width && ry < height;
                let index = if inside { ry * width + rx } else { 0 };
                let place = |cell: usize, share: f32, step: f64| (cell as f64 + f64::from(share)) * step;
                let s = [
                    place(group.column as usize + lane, group.u.as_array_ref()[lane], step[0]),
                    place(j, group.v.as_array_ref()[lane], step[1]),
                ];
                // The squared distance from s of where the reverse model sends the reference pixel, over β² (paper,
                // equation 9).
                let mut distance = 0.0;
                if recover && inside {
                    let d = photo_depth.map_or(0.0, |depth| f64::from(depth[index]));
                    let [u, v, w] = reverse.transform(f64::from(x), f64::from(y), d);
                    let (dx, dy) = (u - s[0] * w, v - s[1] * w);
                    distance = if w > 0.0 { (dx * dx + dy * dy) * per_place / (w * w) } else { f64::INFINITY };
                }
                let kept = if inside { distance < 1.0 } else { !(recover && group.stretched >> lane & 1 != 0) };
                if !kept {
                    continue;
                }
                let tap = Tap::new(s, (target.width(), target.height()));
                let colour = tap.colour(&target);
                let error = |colour| photometric_error(photo[index], colour);
                if distance > 0.0 && per_colour > 0.0 {
                    // What is not quite where it should be and does not look like it either is a ghost.
                    let apart = f64::from(error(colour)) * per_colour;
                    if distance * (1.0 + apart * (1.0 + apart / 16.0)) >= 1.0 {
                        continue;
                    }
                }
                let nearness = target_depth.filter(|_| options.depth || !inside).map(|depth| tap.nearest(depth.data()));
                if taken {
                    // The one already there is compared by its own pixel, so that no errors need to be kept.
                    let worse = if inside {
                        error(colour) >= error(pixels[at])
                    } else {
                        nearness.is_none_or(|nearness| nearness <= depths[at])
                    };
                    if worse {
                        continue;
                    }
                }
                if let Some(nearness) = nearness {
                    depths[at] = nearness;
                }
                state[at] = TAKEN;
                pixels[at] = [colour[0], colour[1], colour[2], 255];
            }
        }
    }

    /// Turns the states into the footprint.
    fn finish(self) -> Vec<f32> {
        self.state.iter_mut().for_each(|state| *state = if *state == 0 { 0 } else { 255 });
        self.depth
    }
}

/// ‖I_r(s') − I_t(s)‖² over RGB.
#[inline(always)]
pub(super) fn photometric_error(reference: [u8; 4], colour: [u8; 4]) -> i32 {
    let [r, g, b] = [0, 1, 2].map(|k| i32::from(colour[k]) - i32::from(reference[k]));
    r * r + g * g + b * b
}
