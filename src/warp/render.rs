//! Backward rendering with void recovery and overlapped-pixel selection (paper, section 3.2, algorithm 2).

use wide::{CmpGt, CmpLt, f32x4, i32x4};

use super::canvas::Canvas;
use super::difference;
use super::grid::VertexGrid;
use super::raster::{BATCH, Covered, LANES, draw_row};
use super::sample::Taps;
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

/// What the photos' mean photometric error adds to 3σ², as a share of it.
const USUAL: f64 = 0.19;

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
    reverse: Projection,
    /// 1/β², β in pixels of the target.
    per_place: f32,
    /// 1/3σ²: σ is the colour distance where the photos are alike, and more where they differ anyway.
    per_colour: f32,
}

impl<'a> Painter<'a> {
    fn new(scene: &'a Scene<'a>, canvas: &'a Canvas, image: &'a mut Image, footprint: &'a mut Mask) -> Result<Self> {
        let WarpOptions { void_distance: place, colour_distance: colour, .. } = *scene.options;
        let (w, h) = (scene.target.width() as f64, scene.target.height() as f64);
        Ok(Self {
            scene,
            canvas,
            pixels: image.data.as_chunks_mut().0,
            state: &mut footprint.data,
            depth: zeroed(scene.target_depth.map_or(0, |_| canvas.width * canvas.height))?,
            reverse: Projection::new(scene.reverse),
            per_place: (1.0 / (place * place * (w * w + h * h))) as f32,
            per_colour: if colour.is_finite() {
                (1.0 / (3.0 * colour * colour + USUAL * difference::mean(scene))) as f32
            } else {
                0.0
            },
        })
    }

    /// Offers the pixels covered by cells of row `j`, which are `step` target pixels wide and high.
    #[inline(always)]
    fn offer(&mut self, groups: &[Covered], j: usize, step: [f64; 2]) {
        // What the loop looks at lies in locals: nothing that is written could change it.
        let Scene { target, target_depth, reference, reference_depth, .. } = *self.scene;
        let options = self.scene.options;
        let recover = options.mode != WarpMode::Backward;
        let select = options.mode == WarpMode::Optimal;
        let per_colour = self.per_colour;
        let (offset_x, offset_y) = self.canvas.offset;
        let shift = i32x4::splat((offset_y * self.canvas.width + offset_x) as i32);
        let stride = i32x4::splat(self.canvas.width as i32);
        let [width, height] = [reference.width(), reference.height()].map(|side| i32x4::splat(side as i32));
        let step = step.map(|step| f32x4::splat(step as f32));
        let state = &mut *self.state;
        let pixels = &mut self.pixels[..state.len()];
        let depths = &mut self.depth[..];
        let (photo, photo_depth) = (reference.pixels(), reference_depth.map(InverseDepth::data));
        for group in groups {
            let (x, y) = (group.x, group.y);
            let at = y * stride + x + shift;
            let before = i32x4::splat(-1);
            let inside = x.cmp_gt(before) & x.cmp_lt(width) & y.cmp_gt(before) & y.cmp_lt(height);
            let index = (y * width + x) & inside;
            let inside = inside.move_mask();
            let s = [
                (f32x4::splat(group.column as f32) + f32x4::new([0.0, 1.0, 2.0, 3.0]) + group.u) * step[0],
                (f32x4::splat(j as f32) + group.v) * step[1],
            ];
            // The squared distance from s of where the reverse model sends the reference pixel, over β² (paper,
            // equation 9); both this and 1 times the same factor.
            let (mut distance, mut one) = (f32x4::ZERO, f32x4::ONE);
            let mut kept = !0;
            if recover {
                let depth = |lane: usize| photo_depth.map_or(0.0, |depth| depth[index.as_array_ref()[lane] as usize]);
                let place = [f32x4::from_i32x4(x), f32x4::from_i32x4(y)];
                let [u, v, w] = self.reverse.transform(place, f32x4::new([depth(0), depth(1), depth(2), depth(3)]));
                let (dx, dy) = (u - s[0] * w, v - s[1] * w);
                (distance, one) = ((dx * dx + dy * dy) * self.per_place, w * w);
                let near = w.cmp_gt(f32x4::ZERO) & distance.cmp_lt(one);
                kept = inside & near.move_mask() | !inside & !group.stretched;
            }
            let taps = Taps::new(s, (target.width(), target.height()));
            let mut lanes = group.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % LANES;
                lanes &= lanes - 1;
                let at = at.as_array_ref()[lane] as usize;
                let taken = state[at] == TAKEN;
                if taken && !select {
                    continue;
                }
                if !taken {
                    state[at] = COVERED;
                }
                if kept >> lane & 1 == 0 {
                    continue;
                }
                let inside = inside >> lane & 1 != 0;
                let colour = taps.colour(lane, &target);
                let error = |colour| photometric_error(photo[index.as_array_ref()[lane] as usize], colour);
                if inside && per_colour > 0.0 {
                    // What is not quite where it should be and does not look like it either is a ghost.
                    let apart = error(colour) as f32 * per_colour;
                    let distance = distance.as_array_ref()[lane] * (1.0 + apart * (1.0 + apart / 16.0));
                    if distance >= one.as_array_ref()[lane] {
                        continue;
                    }
                }
                let depth = target_depth.filter(|_| options.depth || !inside);
                let nearness = depth.map(|depth| taps.nearest(lane, depth.data()));
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

/// A model in single precision, for four points at once.
struct Projection([[f32; 4]; 3]);

impl Projection {
    fn new(model: &Model) -> Self {
        let row = |i: usize| [model.h[(i, 0)], model.h[(i, 1)], model.h[(i, 2)], model.e[i]].map(|v| v as f32);
        Self([row(0), row(1), row(2)])
    }

    /// As [`Model::transform`].
    #[inline(always)]
    fn transform(&self, [x, y]: [f32x4; 2], d: f32x4) -> [f32x4; 3] {
        let row = |[a, b, c, e]: [f32; 4]| x * a + y * b + d * e + f32x4::splat(c);
        [row(self.0[0]), row(self.0[1]), row(self.0[2])]
    }
}

/// ‖I_r(s') − I_t(s)‖² over RGB.
#[inline(always)]
pub(super) fn photometric_error(reference: [u8; 4], colour: [u8; 4]) -> i32 {
    let apart = |k: usize| i32::from(colour[k]) - i32::from(reference[k]);
    let (r, g, b) = (apart(0), apart(1), apart(2));
    r * r + g * g + b * b
}
