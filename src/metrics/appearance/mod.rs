//! What a person sees of a mosaic, as numbers: voids, the seam, steps along it, straight lines that break.
//!
//! PSNR over the overlap is blind to all of these, as the mosaic shows the reference there. Each measure is a function of its
//! own, so that what will be seen can also be predicted before a mosaic is made; lower is better, 0 is perfect.

mod bending;
mod lab;
mod lines;
mod seam;
mod steps;
mod voids;

pub use bending::bending;
pub use lines::{BrokenLines, LineBreaks, broken_lines};
pub use seam::{SeamShape, seam_shape};
pub use steps::{VisibleSteps, visible_steps};
pub use voids::{Voids, voids};

use crate::features::{LineSegmentOptions, line_segments};
use crate::geometry::{Model, check_depth};
use crate::image::check_size;
use crate::mosaic::Mosaic;
use crate::warp::Warped;
use crate::{ImageView, Rect, Result, View};

/// All measures of one mosaic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Where the warped target shows nothing.
    pub voids: Voids,
    /// Where the seam runs.
    pub seam: SeamShape,
    /// Steps along the seam, and elsewhere.
    pub visible_steps: VisibleSteps,
    /// Straight lines of the target that the warp breaks.
    pub broken_lines: BrokenLines,
    /// How far the warp outside the reference is from a homography, in % of the reference's diagonal; `None` where hardly
    /// anything lies outside.
    pub bending: Option<f64>,
}

/// Measures the mosaic of `target`, warped by `forward` (with the target's depth, if there is parallax), and `reference`.
///
/// # Errors
/// `size-mismatch` when canvas, mosaic, masks and photos do not fit each other, `invalid-argument` for a model with parallax
/// and no depth or one that is not finite, `out-of-memory`.
pub fn appearance(
    target: View<'_>,
    reference: ImageView<'_>,
    forward: &Model,
    warped: &Warped,
    mosaic: &Mosaic,
) -> Result<Appearance> {
    warped.check_canvas(reference)?;
    check_depth("targetDepth", &target, forward)?;
    check_size("mosaic", mosaic.image.size(), warped.image.size())?;
    let frame = Rect { x: warped.offset.0, y: warped.offset.1, width: reference.width(), height: reference.height() };
    let (size, frame_size) = (target.image.size(), (frame.width, frame.height));
    let depth = target.depth.filter(|_| forward.has_parallax());
    let segments = line_segments(target.image, &LineSegmentOptions::default())?;
    Ok(Appearance {
        voids: voids(warped, frame)?,
        seam: seam_shape(warped, &mosaic.seam, frame)?,
        visible_steps: visible_steps(mosaic.image.view(), &mosaic.seam)?,
        broken_lines: broken_lines(&segments, size, forward, depth, frame_size),
        bending: bending(size, forward, depth, frame_size)?,
    })
}

/// How far a canvas pixel is inside the border of `frame`, in pixels: 0 on its outermost ones, negative outside.
fn inside(frame: Rect, x: usize, y: usize) -> i64 {
    let along = |v: usize, from: usize, length: usize| {
        let v = v as i64 - from as i64;
        v.min(length as i64 - 1 - v)
    };
    along(x, frame.x, frame.width).min(along(y, frame.y, frame.height))
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}
