//! Depth completion: inverse depth where matching did not find any that is reliable, inside the overlap and outside.

use super::pull_push::Level;
use super::surface::{Equations, OtherView, Solution, Surface, SurfaceShape, sample_grid, segments};
use crate::features::LineSegment;
use crate::geometry::{DepthSample, Model};
use crate::image::{check_size, reserve_more};
use crate::observer::{Observer, report};
use crate::rect::diagonal;
use crate::{ImageView, InverseDepth, Mask, Result, Stage};

/// Fewer samples say nothing.
pub(super) const LEAST_SAMPLES: usize = 20;
/// How far the surface bends away to meet reliable depth, as a share of the diagonal.
pub(super) const REACH: f64 = 0.03;

/// How depth is completed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompletionOptions {
    /// Whether what is reliable stays as it is. Otherwise the surface replaces it, too: then neighbours keep together and
    /// straight lines straight, which noise and edges of the depth do not leave them.
    pub keep_reliable: bool,
    /// Of the surface.
    pub shape: SurfaceShape,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self { keep_reliable: true, shape: SurfaceShape::default() }
    }
}

/// Replaces all inverse depth of the `photo` that is not reliable: where the mask `reliable` is 0 (nowhere by default), and where
/// `model` sends a pixel outside the `other` photo (width, height) or next to its border.
///
/// A robust surface is fitted to what is reliable, bends away within a short distance to meet it, and extrapolates it. A map that is
/// a plane where it is reliable is that plane everywhere.
///
/// Returns the map as it is when hardly any pixel is reliable.
///
/// # Errors
/// `invalid-argument` for a [`SurfaceShape`] whose numbers are out of range, `size-mismatch` for a photo or mask of another size,
/// `out-of-memory`, `aborted`.
pub fn complete_depth(
    depth: &InverseDepth,
    photo: Option<ImageView<'_>>,
    model: &Model,
    other: (usize, usize),
    reliable: Option<&Mask>,
    options: &CompletionOptions,
    observer: &mut dyn Observer,
) -> Result<InverseDepth> {
    options.shape.check()?;
    let other = OtherView::new(model, other);
    let known = KnownDepth::of(depth, photo, other, reliable, &[], observer)?;
    known.completed(options)?.map_or_else(|| depth.map_indexed(|_, d| d), Ok)
}

/// What is known of the depth of a photo, ready to be completed in one way or another.
pub(crate) struct KnownDepth<'a> {
    /// NaN where it is not known.
    depth: InverseDepth,
    /// Straight lines of the photo, along which it is affine.
    segments: Vec<LineSegment>,
    /// Of the surface through it; `None` when hardly anything is known.
    equations: Option<Equations>,
    other: OtherView<'a>,
}

impl<'a> KnownDepth<'a> {
    /// Of a map, what is reliable and lands inside of the other photo; and of `matches`.
    pub fn of(
        depth: &InverseDepth,
        photo: Option<ImageView<'_>>,
        other: OtherView<'a>,
        reliable: Option<&Mask>,
        matches: &[DepthSample],
        observer: &mut dyn Observer,
    ) -> Result<Self> {
        let (w, size) = (depth.width(), depth.size());
        if let Some(mask) = reliable {
            check_size("reliable", mask.size(), size)?;
        }
        if let Some(photo) = photo {
            check_size("photo", photo.size(), size)?;
        }
        report(observer, Stage::Depth, 0.0)?;
        let known = depth.map_indexed(|i, d| {
            let reliable = reliable.is_none_or(|mask| mask.data()[i] != 0);
            if reliable && other.contains([(i % w) as f64, (i / w) as f64], f64::from(d)) { d } else { f32::NAN }
        })?;
        Self::new(known, photo, other, matches, observer)
    }

    /// Of a map that is NaN where it is not known, and of `matches`.
    pub fn new(
        depth: InverseDepth,
        photo: Option<ImageView<'_>>,
        other: OtherView<'a>,
        matches: &[DepthSample],
        observer: &mut dyn Observer,
    ) -> Result<Self> {
        report(observer, Stage::Depth, 0.2)?;
        let mut samples = Vec::new();
        push_samples(&depth, other.model, &mut samples)?;
        let enough = samples.len() + matches.len() >= LEAST_SAMPLES;
        // Two photos alone, which come with matches, have no better way to tell where a lamp post ends. In sets, where more is known, joined lines
        // displace more than they mend: steps of two with exact depth become .071 and .111 instead of .048 and .056.
        let alone = !matches.is_empty();
        let solution = if alone { Solution::Full } else { Solution::Damped };
        let found = photo.filter(|_| enough).map(|photo| segments(photo, alone));
        report(observer, Stage::Depth, 0.5)?;
        let segments = found.transpose()?.unwrap_or_default();
        Self::through(depth, [&samples, matches], photo, (segments, solution), other)
    }

    /// Of a map that is NaN where it is not known, and of `samples` besides, one of which counts as a pixel of the map on the same grid does;
    /// with the photo's [`segments`].
    pub fn and_samples(
        depth: InverseDepth,
        mut samples: Vec<DepthSample>,
        (photo, segments): (ImageView<'_>, &[LineSegment]),
        other: OtherView<'a>,
        observer: &mut dyn Observer,
    ) -> Result<Self> {
        report(observer, Stage::Depth, 0.2)?;
        push_samples(&depth, other.model, &mut samples)?;
        Self::through(depth, [&samples, &[]], Some(photo), (segments.to_vec(), Solution::Damped), other)
    }

    fn through(
        depth: InverseDepth,
        [samples, matches]: [&[DepthSample]; 2],
        photo: Option<ImageView<'_>>,
        (segments, solution): (Vec<LineSegment>, Solution),
        other: OtherView<'a>,
    ) -> Result<Self> {
        let equations = if samples.len() + matches.len() < LEAST_SAMPLES {
            None
        } else {
            Equations::new(samples, matches, depth.size(), photo, (&segments, solution), &other)?
        };
        Ok(Self { depth, segments, equations, other })
    }

    /// The photo outside of which nothing is known.
    pub fn other(&self) -> OtherView<'a> {
        self.other
    }

    /// The straight lines of the photo that take part.
    pub fn segments(&self) -> &[LineSegment] {
        &self.segments
    }

    /// Samples of the map.
    pub fn samples(&self) -> Result<Vec<DepthSample>> {
        let mut found = Vec::new();
        push_samples(&self.depth, self.other.model, &mut found)?;
        Ok(found)
    }

    /// The surface through it; `None` when hardly anything is known.
    pub fn surface(&mut self, shape: SurfaceShape) -> Result<Option<Surface>> {
        self.equations.as_mut().map_or(Ok(None), |equations| equations.solve(&self.other, shape))
    }

    /// A map of that surface, which replaces what is known as well.
    pub fn map(&mut self, shape: SurfaceShape) -> Result<Option<InverseDepth>> {
        let size = self.depth.size();
        self.surface(shape)?.map(|surface| surface.map(size)).transpose()
    }

    /// A whole map; `None` when hardly anything is known.
    pub(crate) fn completed(mut self, options: &CompletionOptions) -> Result<Option<InverseDepth>> {
        let Some(surface) = self.surface(options.shape)? else { return Ok(None) };
        let ((w, h), values) = (self.depth.size(), self.depth.data());
        let mut filled = surface.dense((w, h))?;
        if options.keep_reliable {
            let details = Level::of(w, &filled, values)?.extrapolated(0.5 * REACH * diagonal((w, h)))?;
            for (y, (row, known)) in filled.chunks_exact_mut(w).zip(values.chunks_exact(w)).enumerate() {
                for (x, (filled, &known)) in row.iter_mut().zip(known).enumerate() {
                    *filled = if known.is_nan() { *filled + details.above(x, y) } else { known };
                }
            }
        }
        Ok(Some(InverseDepth::from_values(filled, w, h)))
    }
}

/// Appends samples of a map that is NaN where it is not known; `model` leads to the other photo.
fn push_samples(depth: &InverseDepth, model: &Model, out: &mut Vec<DepthSample>) -> Result<()> {
    let (w, values) = (depth.width(), depth.data());
    for (x, y) in sample_grid(depth.size()) {
        let depth = f64::from(values[y * w + x]);
        if !depth.is_nan() {
            reserve_more(out, 1)?;
            out.push(DepthSample::new(model, [x as f64, y as f64], depth));
        }
    }
    Ok(())
}
