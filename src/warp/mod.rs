//! Optimal image warping (paper, section 3.2 and algorithm 2).
//!
//! | paper | equations | file |
//! |---|---|---|
//! | 3.2.1 forward map of the grid | 4 | `grid.rs`, onto a `projection_surface.rs` if wanted; `forward.rs` is direct forward mapping |
//! | 3.2.1 backward rendering | | `render.rs`, `raster.rs`, `cell.rs`, `sample.rs` |
//! | 3.2.2 void region recovery | 10 to 12 | `candidates.rs` in the overlap, `stretch.rs` outside; `outline.rs` is ours |
//! | 3.2.3 overlapped pixels | 13 to 15 | `selection.rs` |

mod batch;
mod candidates;
mod canvas;
mod cell;
mod depth;
mod difference;
mod forward;
mod grid;
mod outline;
mod projection_surface;
mod raster;
mod render;
mod sample;
mod scene;
mod selection;
mod stretch;
mod trim;

use crate::depth::holes::{self, Holes};
use crate::geometry::{Model, Undistortion, check_views};
use crate::observer::{Observer, report};
use crate::transparency::{Extended, outside};
use crate::{Error, Image, ImageView, InverseDepth, Mask, Result, Stage, View};

pub(crate) use canvas::{Limits, WARPED, bytes_per_pixel};
pub(crate) use grid::MOST_KEPT;
pub use projection_surface::Projection;
pub(crate) use projection_surface::{ProjectionSurface, project};
pub(crate) use sample::bilinear;

/// How the target is rendered into the reference's view (paper, table 2, rows 3, 4, 5 and 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WarpMode {
    /// Every target pixel is put on the nearest canvas pixel.
    Forward,
    /// Every cell is drawn.
    Backward,
    /// Cells, with void recovery.
    BackwardVoid,
    /// Cells, with void recovery and overlapped-pixel selection.
    Optimal,
    /// As `Optimal`, but in the overlap no candidate is void: those that void recovery would remove are shown where there is no
    /// other, with a low [confidence](Warped::confidence). Outside, the outline is cleaned.
    #[default]
    Soft,
}

/// Options of [`warp`].
#[derive(Debug, Clone, PartialEq)]
pub struct WarpOptions {
    /// Which of the paper's modules take part.
    pub mode: WarpMode,
    /// Columns and rows of cells over the target (the paper's C₁×C₂); 0 for one vertex per pixel.
    pub grid: (u32, u32),
    /// How holes of the depth maps are handled.
    pub holes: Holes,
    /// β as a share of the target's diagonal.
    pub void_distance: f64,
    /// σ: how far colours may differ, in levels of 255. Where photos differ by this much in every channel, β is reduced to
    /// about 1/√2, and further beyond. A share of the photos' mean squared difference is added to σ², as noise and exposure
    /// differ everywhere. Infinite in the paper.
    pub colour_distance: f64,
    /// A cell outside the reference is void when a side is this many times longer than the average cell's.
    pub stretch_limit: f64,
    /// How far the canvas may reach beyond each side of the reference, in reference sizes.
    pub canvas_limit: f64,
    /// Most bytes that the canvas and the buffers of its size may take.
    pub max_bytes: u64,
    /// Whether to return [`Warped::depth`].
    pub depth: bool,
}

impl Default for WarpOptions {
    fn default() -> Self {
        Self {
            mode: WarpMode::Soft,
            grid: (0, 0),
            holes: Holes::Nearest,
            void_distance: 0.02,
            colour_distance: 12.0,
            stretch_limit: 5.0,
            canvas_limit: 2.0,
            max_bytes: 1 << 31,
            depth: true,
        }
    }
}

impl WarpOptions {
    /// Those of the published method.
    pub fn paper() -> Self {
        Self {
            mode: WarpMode::Optimal,
            void_distance: 0.01,
            colour_distance: f64::INFINITY,
            stretch_limit: 2.0,
            ..Self::default()
        }
    }
}

/// The target as the reference's camera would see it, on a canvas that holds both photos.
#[derive(Debug, Clone, PartialEq)]
pub struct Warped {
    /// The canvas: RGBA, alpha 255 where the target is visible, 0 elsewhere.
    pub image: Image,
    /// Where any cell of the target was drawn, voided ones and holes in its alpha included.
    pub footprint: Mask,
    /// How well forward and reverse model agree on what is shown: 255 where the reverse model leads back to the very place in
    /// the target, [`RELIABLE`] at the void distance, towards 0 beyond; 255 outside the reference. `None` unless the mode is
    /// [`WarpMode::Soft`]: then all that is shown is reliable.
    pub confidence: Option<Mask>,
    /// Inverse depth of the warped target, in the reference's frame (see [`warp`]), NaN where it is transparent. `None`
    /// without parallax, and unless [`WarpOptions::depth`] is set.
    pub depth: Option<InverseDepth>,
    /// Canvas position of the reference's top left pixel.
    pub offset: (usize, usize),
    /// Whether part of the target lay beyond the canvas limit.
    pub clipped: bool,
}

/// The least confidence of what void recovery would leave.
pub const RELIABLE: u8 = 128;

/// Renders the target in the reference's view (paper, algorithm 2). `forward` maps target to reference, `reverse`
/// back; both take inverse depth as the maps have it.
///
/// Masked pixels of the target are not drawn: where they hang together with its border it ends there, others are voids. Masked pixels of
/// the reference are as outside of it.
///
/// The warped depth is d' = d/λ', λ' the third coordinate of the model's image: 1/z' for d = 1/z, and along a ray of
/// the reference it grows towards the camera whatever affine change the map has undergone.
///
/// # Errors
/// `invalid-argument` for options out of range, a model that needs a depth map it did not get or a target that is all masked, `size-mismatch`,
/// `too-large` when the canvas would exceed `max_bytes`, `no-overlap` when no part of the target lands on the
/// canvas, `out-of-memory`, `aborted`.
pub fn warp(
    target: View<'_>,
    reference: View<'_>,
    forward: &Model,
    reverse: &Model,
    options: &WarpOptions,
    observer: &mut dyn Observer,
) -> Result<Warped> {
    let [rendering, cleaning] = bytes_per_pixel(options.mode, forward.has_parallax(), options.depth);
    let check_canvas = |canvas| canvas::check_budget(canvas, rendering.max(cleaning), options.max_bytes);
    check(&target, &reference, forward, reverse, options)?;
    let extended = Extended::of(target, "target")?;
    let target = Extended::view(&extended, target);
    warp_within(&WarpJob::new([target, reference], forward, reverse), options, &check_canvas, observer)
}

/// What is warped onto what.
#[derive(Clone, Copy)]
pub(crate) struct WarpJob<'a> {
    pub target: View<'a>,
    /// A photo, or a picture made of several.
    pub reference: View<'a>,
    pub forward: &'a Model,
    pub reverse: &'a Model,
    /// What the reference is projected onto, other than a plane: then the models lead to its rays instead of its pixels, and
    /// back from them.
    pub surface: Option<ProjectionSurface>,
    /// The farthest that the target may appear on a plane, where the reference is no photo whose size would say that.
    pub limits: Option<Limits>,
    /// The photo with the distortion of its lens, where the target is that without: then colours are read from it, and it ends
    /// where it ends.
    pub distorted: Option<Distorted<'a>>,
}

/// A photo as the camera gave it, and where its pixels are without distortion.
#[derive(Clone, Copy)]
pub(crate) struct Distorted<'a> {
    pub photo: ImageView<'a>,
    pub lens: Undistortion,
}

impl<'a> WarpJob<'a> {
    pub fn new([target, reference]: [View<'a>; 2], forward: &'a Model, reverse: &'a Model) -> Self {
        Self { target, reference, forward, reverse, surface: None, limits: None, distorted: None }
    }
}

/// [`warp`], with a check of its own of the canvas (width, height) before that is allocated.
pub(crate) fn warp_within(
    job: &WarpJob<'_>,
    options: &WarpOptions,
    check_canvas: &dyn Fn((usize, usize)) -> Result<()>,
    observer: &mut dyn Observer,
) -> Result<Warped> {
    let &WarpJob { target, reference, forward, reverse, surface, limits, distorted } = job;
    check(&target, &reference, forward, reverse, options)?;
    report(observer, Stage::Warp, 0.0)?;
    // Without parallax depth plays no part, so neither do its holes.
    let target_depth = holes::resolve(target.depth.filter(|_| forward.has_parallax()), options.holes)?;
    let limits = match (&surface, limits) {
        (Some(surface), _) => surface.limits(),
        (None, Some(limits)) => limits,
        (None, None) => Limits::new(reference.image.size(), options.canvas_limit),
    };
    let outside = outside(target.image)?;
    let map = grid::Map { model: forward, surface, outside: outside.as_ref(), limits };
    let grid = grid::VertexGrid::map(target.image.size(), target_depth.as_deref(), &map, options.grid)?;
    let canvas = canvas::Canvas::around(grid.bounds, &reference.image);
    check_canvas((canvas.width, canvas.height))?;
    report(observer, Stage::Warp, 0.2)?;
    let mut image = Image::transparent(canvas.width, canvas.height)?;
    let mut footprint = Mask::empty(canvas.width, canvas.height)?;
    let mut confidence = match options.mode {
        WarpMode::Soft => Some(Mask::empty(canvas.width, canvas.height)?),
        _ => None,
    };
    let mut depth = if options.mode == WarpMode::Forward {
        let mut out = forward::Output { image: &mut image, footprint: &mut footprint, with_depth: options.depth };
        forward::splat(&target.image, target_depth.as_deref(), &map, &canvas, &mut out)?
    } else {
        let reference_depth = holes::resolve(reference.depth.filter(|_| reverse.has_parallax()), options.holes)?;
        let scene = scene::Scene {
            target: target.image,
            distorted,
            target_depth: target_depth.as_deref(),
            outside: outside.as_ref(),
            reference: reference.image,
            reference_depth: reference_depth.as_deref(),
            reverse,
            surface,
            options,
        };
        let mut out = render::Output { image: &mut image, footprint: &mut footprint, confidence: confidence.as_mut() };
        render::render(&scene, &grid, &canvas, &mut out, observer)?
    };
    // What was only needed for rendering makes room.
    let clipped = grid.clipped;
    drop(grid);
    if !options.depth {
        depth = Vec::new();
    }
    if options.mode == WarpMode::Soft {
        outline::clean(&mut image, &mut footprint, &canvas, &reference.image)?;
    }
    let depth = depth::in_reference_frame(depth, &image, &map, canvas.offset);
    let warped = Warped { image, footprint, confidence, depth, offset: canvas.offset, clipped };
    let warped = if options.mode == WarpMode::Soft { warped.trimmed(reference.image.size()) } else { warped };
    report(observer, Stage::Warp, 1.0)?;
    Ok(warped)
}

fn check(
    target: &View<'_>,
    reference: &View<'_>,
    forward: &Model,
    reverse: &Model,
    options: &WarpOptions,
) -> Result<()> {
    options.check()?;
    check_views(target, reference, forward, reverse)
}

impl WarpOptions {
    /// Refuses what is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        let finite = "a finite number above 0";
        for (name, value, most, expected) in [
            ("voidDistance", self.void_distance, f64::MAX, finite),
            ("stretchLimit", self.stretch_limit, f64::MAX, finite),
            ("colourDistance", self.colour_distance, f64::INFINITY, "above 0"),
        ] {
            if !(value > 0.0 && value <= most) {
                return Err(Error::InvalidArgument { name, expected, value }.into());
            }
        }
        if !(0.0..=100.0).contains(&self.canvas_limit) {
            let value = self.canvas_limit;
            return Err(Error::InvalidArgument { name: "canvasLimit", expected: "from 0 to 100", value }.into());
        }
        Ok(())
    }
}
