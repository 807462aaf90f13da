//! The canvas that holds both photos, and how large it may get.

use wide::{CmpGe, CmpLe, f64x2};

use super::{WarpMode, Warped};
use crate::image::check_size;
use crate::{Error, ImageView, InverseDepth, Mask, Rect, Result};

/// Bytes per canvas pixel: the warped target and its footprint, the confidence in it, its depth, and what cleaning the outline takes: what is
/// covered, and distances.
pub(crate) const WARPED: u64 = 4 + 1;
const CONFIDENCE: u64 = 1;
const DEPTH: u64 = 4;
const OUTLINE: u64 = 1 + 2 * 2;

/// Bytes for each pixel of the canvas while the target is rendered, and while its outline is cleaned: with `parallax` depth is compared, and a
/// part of the result if that `wants_depth`.
pub(crate) fn bytes_per_pixel(mode: WarpMode, parallax: bool, wants_depth: bool) -> [u64; 2] {
    let if_so = |so: bool, bytes: u64| if so { bytes } else { 0 };
    let soft = mode == WarpMode::Soft;
    let rendering = if_so(parallax && mode != WarpMode::Forward, DEPTH);
    let cleaning = if_so(parallax && wants_depth, DEPTH) + if_so(soft, OUTLINE);
    [rendering, cleaning].map(|own| WARPED + if_so(soft, CONFIDENCE) + own)
}

/// The farthest that vertices may land, in reference pixels. Without it one vertex near the horizon makes the canvas
/// explode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub min: [f64; 2],
    pub max: [f64; 2],
}

impl Limits {
    /// `canvas_limit` times the reference's size beyond each of its sides.
    pub fn new(reference: (usize, usize), canvas_limit: f64) -> Self {
        let (w, h) = (reference.0 as f64, reference.1 as f64);
        Self { min: [-canvas_limit * w, -canvas_limit * h], max: [(1.0 + canvas_limit) * w, (1.0 + canvas_limit) * h] }
    }

    /// The same beyond what appears within `bounds` as well: smallest and largest x and y.
    pub fn with(reference: (usize, usize), [x0, y0, x1, y1]: [f64; 4], canvas_limit: f64) -> Self {
        let Self { min: [left, top], max: [right, bottom] } = Self::new(reference, canvas_limit);
        let (w, h) = (reference.0 as f64, reference.1 as f64);
        Self {
            min: [left + x0.min(0.0), top + y0.min(0.0)],
            max: [right + (x1 - w).max(0.0), bottom + (y1 - h).max(0.0)],
        }
    }

    /// The same for places that are counted from `origin`.
    pub fn relative_to(self, origin: [i64; 2]) -> Self {
        let shifted = |place: [f64; 2]| [0, 1].map(|k| place[k] - origin[k] as f64);
        Self { min: shifted(self.min), max: shifted(self.max) }
    }

    /// Which of two places lie within, all bits or none.
    #[inline(always)]
    pub fn contain(&self, place: [f64x2; 2]) -> f64x2 {
        let within = |k: usize| place[k].cmp_ge(f64x2::splat(self.min[k])) & place[k].cmp_le(f64x2::splat(self.max[k]));
        within(0) & within(1)
    }
}

/// Size of the canvas and where the reference lies on it.
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    /// Canvas position of the reference's top left pixel.
    pub offset: (usize, usize),
}

impl Canvas {
    /// The smallest canvas around the reference and all that lies in `bounds`, in reference pixels: smallest and largest
    /// x and y.
    pub fn around([x0, y0, x1, y1]: [f64; 4], reference: &ImageView<'_>) -> Self {
        let (w, h) = reference.size();
        let offset = ((-x0.floor()).max(0.0) as usize, (-y0.floor()).max(0.0) as usize);
        let width = x1.ceil().max(w as f64 - 1.0) as usize + offset.0 + 1;
        let height = y1.ceil().max(h as f64 - 1.0) as usize + offset.1 + 1;
        Self { width, height, offset }
    }
}

/// Refuses a canvas that would take more than `limit` bytes at so many for each pixel.
pub(super) fn check_budget((width, height): (usize, usize), bytes_per_pixel: u64, limit: u64) -> Result<()> {
    let (width, height) = (width as u64, height as u64);
    let bytes = width.saturating_mul(height).saturating_mul(bytes_per_pixel);
    if bytes > limit { Err(Error::TooLarge { width, height, bytes, limit }.into()) } else { Ok(()) }
}

impl Warped {
    /// Checks that footprint, confidence and depth have the canvas' size.
    ///
    /// # Errors
    /// `size-mismatch`.
    pub(crate) fn check(&self) -> Result<()> {
        let Self { image, footprint, confidence, depth, .. } = self;
        let sizes = [
            ("footprint", Some(footprint.size())),
            ("confidence", confidence.as_ref().map(Mask::size)),
            ("depth", depth.as_ref().map(InverseDepth::size)),
        ];
        sizes.into_iter().try_for_each(|(name, size)| size.map_or(Ok(()), |size| check_size(name, size, image.size())))
    }

    /// The same, and that the reference lies inside the canvas at [`Warped::offset`].
    ///
    /// # Errors
    /// `size-mismatch`; where the canvas is too small, the expected size is the smallest that would do.
    pub(crate) fn check_canvas(&self, reference: ImageView<'_>) -> Result<()> {
        let ((x, y), (width, height)) = (self.offset, reference.size());
        self.check_frame(Rect { x, y, width, height })
    }

    /// The same for a reference at `frame`.
    ///
    /// # Errors
    /// As [`Warped::check_canvas`].
    pub(crate) fn check_frame(&self, frame: Rect) -> Result<()> {
        self.check()?;
        let (width, height) = self.image.size();
        let (right, bottom) = (frame.x.saturating_add(frame.width), frame.y.saturating_add(frame.height));
        check_size("canvas", (width, height), (width.max(right), height.max(bottom)))
    }
}
