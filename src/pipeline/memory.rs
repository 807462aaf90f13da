//! How much memory a job takes: bytes per pixel of every stage. The peak is that of the largest one.
//!
//! The numbers follow from the buffers that a stage holds at its worst moment; `tests/memory.rs` and `npm run bench`
//! compare them with what is really taken. What depends on the photos' contents (keypoints, seam, voids) is as in a typical
//! pair, so that the prediction is right to about a fifth.

use super::halved::{half_size, is_halved};
use super::options::{Options, WithoutDepth};
use super::picture::Size;
use crate::features::reduced;
use crate::mosaic::{Blending, EDGE_NODES, FillMethod, Seam, node_side};
use crate::warp::{MOST_KEPT, Projection, WARPED, WarpMode, bytes_per_pixel};
use crate::{Error, Result, Stage, View};

/// What the pipeline is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Job {
    /// Sizes of target and reference.
    pub photos: [Size; 2],
    /// Whether target and reference have depth maps.
    pub depth: [bool; 2],
    /// Whether matches are given.
    pub matches: bool,
    /// Whether target and reference are known to have masked pixels.
    pub masked: [bool; 2],
}

impl Job {
    /// The job of stitching these views.
    pub fn of(views: [View<'_>; 2], matches: bool) -> Self {
        let photos = views.map(|view| view.image.size());
        let masked = views.map(|view| view.image.is_masked());
        Self { photos, depth: views.map(|view| view.depth.is_some()), matches, masked }
    }
}

/// A number of pixels, or of bytes: far beyond any memory they saturate.
pub(super) fn pixels((width, height): Size) -> u64 {
    (width as u64).saturating_mul(height as u64)
}

fn sum(bytes: [u64; 2]) -> u64 {
    bytes[0].saturating_add(bytes[1])
}

/// What is there before any stage: static data and stack of the wasm module.
const MODULE: u64 = if cfg!(target_arch = "wasm32") { 1_200_000 } else { 0 };
/// What the allocator of wasm takes beyond what is in use, as free blocks are too small for the next one: per cent. More where no stage
/// takes much more than the others, as with smooth surfaces; hardly any where photos are halved, as all that is large comes last.
const FRAGMENTATION: u64 = if cfg!(target_arch = "wasm32") { 10 } else { 0 };
const FRAGMENTATION_SMOOTH: u64 = 2 * FRAGMENTATION;
const FRAGMENTATION_HALVED: u64 = FRAGMENTATION / 5;
/// An RGBA photo, and a map of `f32`.
pub(super) const RGBA: u64 = 4;
pub(super) const MAP: u64 = 4;
pub(super) const MASK: u64 = 1;
/// What a stage knows of masked pixels: distances, or marks.
pub(super) const MASKED: u64 = 2;

/// Descriptor and keypoint.
pub(super) const FEATURE: u64 = 128 + 20;
/// Pixels per feature in a photo with texture, and most features of such a photo.
const PIXELS_PER_FEATURE: u64 = 50;
const FEATURES: u64 = 6000;
/// Levels of all octaves: 2¼ planes of floats each, together 4/3 of the first.
const SCALE_SPACE: u64 = 12;
/// Rows of levels and of their differences that an octave is working on.
const SCALE_SPACE_ROWS: u64 = 440;

/// Refinement holds gray levels, shifts, marks and depth of both photos when it extrapolates the corrections of one by a
/// pyramid of 17 bytes per pixel; while costs are aggregated it has less of that, and bands of rows.
const REFINE: u64 = 49;
const AGGREGATE: u64 = 20;
const AGGREGATE_ROWS: u64 = 144 * 16 + 128 * 32 + 7 * 15;
/// Photos of more pixels are refined at half their size; so are those without depth maps.
const REFINE_FULL_SIZE: u64 = 6_000_000;

/// Depth from the photos alone: dense maps and the sums that they are made of.
const DENSE: u64 = 22;
/// Completing one map: the banded equations of a mesh, what is known of the map and of the border, and the search for line segments.
const MESH: u64 = 5_000_000;
const COMPLETE: u64 = MAP + 20;

/// Vertices in fixed point.
const VERTEX: u64 = 8;
/// Mosaic, seam, voids.
const MOSAIC: u64 = RGBA + 2 * MASK;
/// The pyramid of multi-band blending: 32 bytes at half the resolution and all coarser ones, over most of the canvas.
const BANDS: f64 = 32.0 / 3.0;
/// Alignment across the seam: bytes of a node of its grid, most of which are far from the seam or behind the reference.
const ALIGNMENT: u64 = 30;
/// The same of the grid on which straight edges are looked for: fewer, as less of the canvas is as near to the seam.
const EDGES: u64 = 12;
/// Smooth filling numbers the pixels of its window.
const SMOOTH_FILL: u64 = 5;
/// Exemplar filling holds 24 bytes per pixel of its windows, which take about a third of the canvas, and half of that where smooth
/// surfaces leave few voids.
const EXEMPLAR_FILL: u64 = 10;

/// The predicted peaks of one job.
#[derive(Debug, Clone, Copy)]
pub struct Memory<'a> {
    job: Job,
    options: &'a Options,
    /// Whether the reference is projected.
    projecting: bool,
    /// Whether large photos alone are halved.
    halving: bool,
    /// Whether the photos are aligned, too.
    aligning: bool,
}

impl<'a> Memory<'a> {
    /// Of a job. Automatic projection is taken for the plane until it is known to be something else.
    pub fn of(job: Job, options: &'a Options) -> Self {
        let projecting = !matches!(options.projection, None | Some(Projection::Plane));
        Self { job, options, projecting, halving: true, aligning: true }
    }

    /// Of photos that are aligned at their own size, however large.
    pub(super) fn unhalved(self) -> Self {
        Self { halving: false, ..self }
    }

    /// Of photos that are aligned already.
    pub(super) fn drawing(self) -> Self {
        Self { aligning: false, ..self }
    }

    /// With the reference on a cylinder or a sphere.
    pub(super) fn projecting(self) -> Self {
        Self { projecting: true, ..self }
    }

    /// The stage that takes most, and its bytes, with a canvas of this size; (0, 0) for [`align`](super::align) alone.
    pub fn peak(&self, canvas: Size) -> (Stage, u64) {
        let held = MODULE.saturating_add(self.inputs());
        let aligning = [
            (Stage::Detect, self.detection()),
            (Stage::Depth, self.two_view_depth()),
            (Stage::Refine, self.refinement()),
        ];
        let drawing = [
            (Stage::Warp, self.warp(pixels(canvas))),
            (Stage::Blend, self.blend(pixels(canvas))),
            (Stage::Fill, self.fill(pixels(canvas))),
        ];
        let stages = aligning.into_iter().filter(|_| self.aligning).chain(drawing);
        let (stage, bytes) = stages.fold((Stage::Input, 0), |a, b| if b.1 > a.1 { b } else { a });
        let bytes = bytes.saturating_add(held);
        let fragmentation = match (self.smooth(), self.aligned().1) {
            (true, 0) => FRAGMENTATION_SMOOTH,
            (true, _) => FRAGMENTATION_HALVED,
            (false, _) => FRAGMENTATION,
        };
        (stage, bytes.saturating_add(bytes / 100 * fragmentation))
    }

    /// Refuses the job when it would take more than [`max_bytes`](crate::warp::WarpOptions::max_bytes) with this canvas.
    /// Before the canvas is known, pass the reference's size: it is never smaller.
    ///
    /// # Errors
    /// `too-large`, for the largest of canvas and photos.
    pub fn check(&self, canvas: Size) -> Result<()> {
        let [target, reference] = self.job.photos;
        let largest = [target, reference].into_iter().fold(canvas, |a, b| if pixels(b) > pixels(a) { b } else { a });
        refuse_above(self.options.warp.max_bytes, self.peak(canvas).1, largest)
    }

    /// How many times over the memory may be taken that the job takes with this canvas.
    #[cfg(all(target_arch = "wasm32", feature = "wasm-core"))]
    pub(crate) fn times(&self, canvas: Size) -> u64 {
        self.options.warp.max_bytes / self.peak(canvas).1.max(1)
    }

    fn photos(&self) -> [u64; 2] {
        self.job.photos.map(pixels)
    }

    /// Photos and depth maps as they are given, and copies of masked ones.
    fn inputs(&self) -> u64 {
        let photos = self.photos().into_iter().zip(self.job.depth).zip(self.job.masked);
        let bytes = photos.map(|((pixels, depth), masked)| {
            let given = RGBA + if depth { MAP } else { 0 };
            pixels.saturating_mul(if masked { 2 * given + MASKED } else { given })
        });
        bytes.fold(0, u64::saturating_add)
    }

    /// Whether depth plays a part, and whether it comes from the photos alone.
    fn parallax(&self) -> (bool, bool) {
        let two_view = self.options.without_depth == WithoutDepth::TwoView;
        let none = self.job.depth == [false; 2];
        (two_view || self.job.depth == [true; 2], two_view && none)
    }

    /// Whether smooth surfaces take the place of what was refined: with two photos alone.
    fn smooth(&self) -> bool {
        self.parallax().1 && self.options.refine.is_some()
    }

    /// Maps and masks of target and reference that the pipeline itself holds from the depth stage on.
    fn maps(&self) -> [u64; 2] {
        let (parallax, two_view) = self.parallax();
        let refined = self.options.refine.is_some();
        let map = |side: usize| {
            let own = parallax && (two_view || refined || !self.job.depth[side]);
            self.photos()[side].saturating_mul(if own { MAP } else { 0 })
        };
        let reference = self.photos()[1];
        let reliable = if parallax && refined && !two_view { reference.saturating_mul(MASK) } else { 0 };
        [map(0), map(1).saturating_add(reliable)]
    }

    /// The reference as it is projected.
    fn projected(&self) -> u64 {
        if self.projecting { self.photos()[1].saturating_mul(RGBA + MAP + MASK) } else { 0 }
    }

    fn detection(&self) -> u64 {
        if self.job.matches {
            return 0;
        }
        let options = &self.options.features.detect;
        let grow: u64 = if options.upsample { 2 } else { 1 };
        let of = |size: Size| {
            let (width, height) = reduced(size, options.max_size);
            let plane = pixels((width, height)).saturating_mul(grow * grow);
            let features = (pixels((width, height)) / PIXELS_PER_FEATURE).min(FEATURES) * FEATURE;
            let rows = SCALE_SPACE_ROWS * 4 * grow * width as u64;
            [plane.saturating_mul(SCALE_SPACE).saturating_add(rows), features]
        };
        let [[first, kept], [second, own]] = self.job.photos.map(of);
        first.max(second.saturating_add(kept)).saturating_add(own)
    }

    /// The sizes in which the photos are aligned, and the bytes of photos of these sizes where they are not their own.
    fn aligned(&self) -> ([Size; 2], u64) {
        let (mut sizes, mut bytes) = (self.job.photos, 0);
        while self.halving && is_halved(sizes, self.job.depth == [false; 2], self.options) {
            sizes = sizes.map(half_size);
            bytes = sum(sizes.map(pixels)).saturating_mul(RGBA);
        }
        (sizes, bytes)
    }

    fn two_view_depth(&self) -> u64 {
        let ([target, reference], photos) = self.aligned();
        let larger = pixels(target).max(pixels(reference));
        if self.parallax().1 { DENSE.saturating_mul(larger).saturating_add(photos) } else { 0 }
    }

    fn refinement(&self) -> u64 {
        let (parallax, two_view) = self.parallax();
        if self.options.refine.is_none() || !parallax {
            return sum(self.maps());
        }
        let ([target, reference], photos) = self.aligned();
        let (both, larger) = (sum([target, reference].map(pixels)), pixels(target).max(pixels(reference)));
        let priors = if two_view { both.saturating_mul(MAP) } else { 0 };
        let width = target.0.max(reference.0) as u64;
        let search = |pixels: u64, width: u64| {
            REFINE.saturating_mul(pixels).max(AGGREGATE.saturating_mul(pixels).saturating_add(AGGREGATE_ROWS * width))
        };
        if larger <= REFINE_FULL_SIZE && !two_view {
            return priors.saturating_add(search(larger, width));
        }
        // All of both, and the corrections and gray levels of one.
        let results = both.saturating_mul(MAP + MASK);
        let upsampling = results.saturating_add(larger.saturating_mul(MAP + 3 * MASK));
        let completion = results.saturating_add(larger.saturating_mul(COMPLETE)).saturating_add(MESH);
        let refining = priors.saturating_add(search(larger / 4, width / 2).max(upsampling));
        if !two_view {
            return refining;
        }
        // Both maps at last, in the size of the photos.
        let enlarging = if photos > 0 { sum(self.maps()).saturating_add(both.saturating_mul(MAP)) } else { 0 };
        refining.max(completion).max(enlarging).saturating_add(photos)
    }

    /// What is read of the reference after the warp, and the warped target.
    fn warped(&self, canvas: u64) -> u64 {
        let [target, reference] = self.maps();
        let maps = match (self.options.output_depth, self.smooth()) {
            (true, _) => target.saturating_add(reference),
            (false, false) => reference,
            (false, true) => 0,
        };
        let warped = canvas.saturating_mul(WARPED + self.confidence() + self.warped_depth());
        maps.saturating_add(self.projected()).saturating_add(warped)
    }

    /// The depth that guides the filling.
    fn warped_depth(&self) -> u64 {
        let exemplar = self.options.fill.as_ref().is_some_and(|fill| fill.method == FillMethod::Exemplar);
        let wanted = self.options.warp.depth && exemplar && !self.smooth();
        if self.parallax().0 && wanted { MAP } else { 0 }
    }

    fn confidence(&self) -> u64 {
        if self.options.warp.mode == WarpMode::Soft { MASK } else { 0 }
    }

    fn warp(&self, canvas: u64) -> u64 {
        let ((columns, rows), (width, height)) = (self.options.warp.grid, self.job.photos[0]);
        let along = |cells: u32, side: usize| if cells == 0 { side } else { side.min(cells as usize + 1) };
        let vertices = pixels((along(columns, width), along(rows, height)));
        // Of more, two rows.
        let vertices = if vertices > MOST_KEPT as u64 { 0 } else { vertices };
        let maps = self.maps().into_iter().fold(self.projected(), u64::saturating_add);
        let of_canvas = bytes_per_pixel(self.options.warp.mode, self.parallax().0, self.warped_depth() > 0);
        let [rendering, cleaning] = of_canvas.map(|bytes| maps.saturating_add(canvas.saturating_mul(bytes)));
        rendering.saturating_add(vertices.saturating_mul(VERTEX)).max(cleaning)
    }

    fn blend(&self, canvas: u64) -> u64 {
        let bands = match self.options.blend.blending {
            Blending::Multiband => (BANDS * canvas as f64) as u64,
            // From the seam, to either side, and from the border of either photo: that of the reference unless it is a rectangle.
            Blending::Feather => {
                canvas.saturating_mul(MASKED * if self.job.masked[1] || self.projecting { 4 } else { 3 })
            }
            Blending::Average => 0,
        };
        let aligned = match self.options.blend.seam {
            Seam::Aligned => {
                let nodes = canvas / (node_side(self.job.photos[1]) as u64).pow(2);
                let edges = canvas.min(EDGE_NODES as u64) * EDGES;
                canvas.saturating_mul(RGBA).max(nodes.saturating_mul(ALIGNMENT)).max(edges)
            }
            _ => 0,
        };
        let own = canvas.saturating_mul(RGBA + MASK).saturating_add(bands.max(canvas * MASK).max(aligned));
        self.warped(canvas).saturating_add(own)
    }

    fn fill(&self, canvas: u64) -> u64 {
        let own = match self.options.fill.as_ref().map(|fill| fill.method) {
            None => 0,
            Some(FillMethod::Smooth) => SMOOTH_FILL,
            Some(FillMethod::Exemplar) => EXEMPLAR_FILL / if self.smooth() { 2 } else { 1 },
        };
        self.warped(canvas).saturating_add(canvas.saturating_mul(MOSAIC + own))
    }
}

/// Refuses photos that with their depth maps alone would take more than `limit` bytes: for stages that are called alone.
///
/// # Errors
/// `too-large`, for the larger photo.
#[cfg(all(target_arch = "wasm32", feature = "wasm-core"))]
pub(crate) fn check_inputs(photos: [Size; 2], limit: u64) -> Result<()> {
    let [target, reference] = photos;
    let larger = if pixels(target) > pixels(reference) { target } else { reference };
    let bytes = pixels(target).saturating_add(pixels(reference)).saturating_mul(RGBA + MAP);
    refuse_above(limit, bytes, larger)
}

pub(super) fn refuse_above(limit: u64, bytes: u64, (width, height): Size) -> Result<()> {
    if bytes > limit {
        Err(Error::TooLarge { width: width as u64, height: height as u64, bytes, limit }.into())
    } else {
        Ok(())
    }
}
