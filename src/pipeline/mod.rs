//! From two photos to a mosaic (paper, algorithm 3): features → geometry → depth → warp → mosaic.
//!
//! [`stitch`] runs the whole pipeline and [`align`] its first half. Every stage is a function of its own and can be called
//! alone:
//!
//! | stage | function |
//! |---|---|
//! | features | [`detect_pair`], [`match_pair`] |
//! | geometry | [`estimate`](crate::geometry::estimate) |
//! | depth | [`two_view`](crate::depth::two_view), [`derive_missing`](crate::depth::derive_missing), [`refine`](crate::depth::refine) |
//! | warp | [`warp`](crate::warp::warp) |
//! | mosaic | [`blend`], [`fill`], [`crop`] |
//! | measure | [`quality`] |

mod align;
mod bilinear;
mod canvas_matches;
mod extrapolation;
mod features;
mod halved;
pub mod many;
mod memory;
mod misalignment;
mod models;
mod options;
mod picture;
mod prediction;
mod projected;
mod straightness;
mod timer;
mod visible;

use std::borrow::Cow;

#[cfg(all(target_arch = "wasm32", feature = "wasm-core"))]
pub(crate) use align::align_with_workers;
pub use align::{Alignment, align};
pub(crate) use features::{Detect, DetectWorkers};
pub use features::{FeatureOptions, MatchedFeatures, detect_pair, match_pair};
#[cfg(all(target_arch = "wasm32", feature = "wasm-core"))]
pub(crate) use memory::check_inputs;
pub use memory::{Job, Memory};
pub use options::{Mode, Options, WithoutDepth};

use crate::geometry::{Estimate, Match};
use crate::metrics::{Quality, quality};
use crate::mosaic::{FillGuide, FillMethod, Mosaic, SeamGuide, blend, crop, fill};
use crate::observer::{Observer, Portion, report};
use crate::report::Warning;
use crate::warp::{Projection, WarpJob, WarpOptions, Warped, warp_within};
use crate::workers::without_waiting;
use crate::{Image, InverseDepth, Mask, Rect, Result, Stage, View};
use align::align_timed;
use canvas_matches::canvas_matches;
use projected::ProjectedReference;
use timer::StageTimer;
use visible::VisiblePair;

/// Below this SSIM over the valid overlap the two photos hardly show the same thing.
const POOR_SSIM: f64 = 0.35;
/// Below this share of the reference the overlap says little about the alignment.
const SMALL_COVERAGE: f64 = 0.05;

/// How much of the warp is that of the reference, about, where both photos are projected.
const PROJECTING: f32 = 0.3;

/// Rectangles of the mosaic; `None` only where nothing is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crops {
    /// The largest one without a transparent pixel.
    pub inner: Option<Rect>,
    /// The smallest one with everything.
    pub bounds: Option<Rect>,
}

/// The result of [`stitch`].
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// The matches that were found; `None` when they were given.
    pub matches: Option<Vec<Match>>,
    /// Both models, and how they were found.
    pub geometry: Estimate,
    /// With [`Options::output_depth`] and parallax, the inverse depth of target and reference that was used.
    pub depth: [Option<InverseDepth>; 2],
    /// The target in the reference's view, without its depth.
    pub warped: Warped,
    /// Both photos together, voids filled if asked for.
    pub mosaic: Mosaic,
    /// What both are shown on.
    pub projection: Projection,
    /// Unless that is the plane, the reference as it is shown, transparent elsewhere: [`Warped::offset`] is the position of its top left
    /// pixel, and it takes the photo's place wherever the mosaic or the warped target is compared with the reference.
    pub projected_reference: Option<Image>,
    /// How the mosaic can be cropped.
    pub crops: Crops,
    /// Agreement over the overlap.
    pub quality: Quality,
    /// Warnings about the result, those of the fit first.
    pub warnings: Vec<Warning>,
    /// Milliseconds per stage, by the observer's clock.
    pub times: Vec<(Stage, f64)>,
}

/// Stitches `target` onto `reference`. Without `matches`, features of both photos are detected and matched. Masked pixels
/// ([`ImageView`](crate::ImageView)) take part in nothing, nor do depth and matches given for them.
///
/// # Errors
/// `invalid-argument` for a photo that is all masked.
/// `too-large` when the [predicted peak](Memory) exceeds [`WarpOptions::max_bytes`]: before anything is allocated, or once the
/// size of the canvas is known. Those of the stages: see [`align`], [`warp`](crate::warp::warp), [`quality`], [`blend`] and [`fill`].
pub fn stitch(
    matches: Option<&[Match]>,
    target: View<'_>,
    reference: View<'_>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Stitched> {
    let mut depth = [None, None];
    let mut keep = |side: usize, map: Cow<'_, InverseDepth>| depth[side] = Some(map.into_owned());
    let take: Option<&mut DepthSink<'_>> = if options.output_depth { Some(&mut keep) } else { None };
    let stitched = stitch_with_depth_sink(matches, target, reference, options, take, observer)?;
    Ok(Stitched { depth, ..stitched })
}

/// Takes the inverse depth of the target (0) or the reference (1), which nothing reads any more.
pub type DepthSink<'t> = dyn FnMut(usize, Cow<'_, InverseDepth>) + 't;

/// As [`stitch`], but the inverse depth that was used is given to `depth_sink` as soon as nothing reads it any more, so that it
/// takes no memory while the photos are blended; [`Stitched::depth`] is empty.
///
/// # Errors
/// As [`stitch`].
pub fn stitch_with_depth_sink(
    matches: Option<&[Match]>,
    target: View<'_>,
    reference: View<'_>,
    options: &Options,
    depth_sink: Option<&mut DepthSink<'_>>,
    observer: &mut dyn Observer,
) -> Result<Stitched> {
    without_waiting(stitch_with_workers(matches, [target, reference], options, depth_sink, &(), observer))
}

/// As [`stitch_with_depth_sink`], with tasks left to workers.
pub(crate) async fn stitch_with_workers(
    given: Option<&[Match]>,
    views: [View<'_>; 2],
    options: &Options,
    mut depth_sink: Option<&mut DepthSink<'_>>,
    workers: &DetectWorkers,
    observer: &mut dyn Observer,
) -> Result<Stitched> {
    options.check()?;
    let memory = Memory::of(Job::of(views, given.is_some()), options);
    memory.check(views[1].image.size())?;
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePair::of(given, views)?;
    let (matches, views) = (visible.matches(given), visible.views(views));
    let [target, reference] = views;
    let mut alignment = align_timed(matches, views, options, workers, observer, &mut timer).await?;
    let used = matches.or(alignment.matches.as_deref()).unwrap_or_default();
    let projecting = &mut Portion::new(observer, 0.0, PROJECTING);
    let projected = ProjectedReference::of(&alignment, used, views, options, &memory, projecting)?;
    let (memory, from) = if projected.is_some() { (memory.projecting(), PROJECTING) } else { (memory, 0.0) };
    let warping = &mut Portion::new(observer, from, 1.0);
    let mut warped = warp_aligned(&alignment, projected.as_ref(), views, options, &memory, warping)?;
    timer.end(Stage::Warp, observer);
    let matches =
        &canvas_matches(used, [target.image, reference.image], &alignment, projected.as_ref(), warped.offset)?;
    // Maps that nothing reads any more make room: what nobody takes is dropped at once.
    let mut give_depth = |side: usize, map: &mut Option<Cow<'_, InverseDepth>>| {
        if let (Some(take), Some(map)) = (&mut depth_sink, map.take()) {
            take(side, map);
        }
    };
    give_depth(0, &mut alignment.depth[0]);
    if warped.depth.is_none() {
        give_depth(1, &mut alignment.depth[1]);
    }
    let (shown, reliable) = match &projected {
        Some(projected) => (projected.view(), projected.reliable.as_ref()),
        None => (alignment.views(target, reference)[1], alignment.reliable.as_ref()),
    };
    let guide = SeamGuide { reliable, matches };
    let mut mosaic = blend(&warped, shown.image, &guide, &options.blend, observer)?;
    timer.end(Stage::Blend, observer);
    report(observer, Stage::Measure, 0.0)?;
    let quality = quality(&warped, shown.image, mosaic.gains)?;
    timer.end(Stage::Measure, observer);
    let guide = fill_guide(&mut warped, &mosaic.seam, &alignment, projected.as_ref(), shown, options)?;
    give_depth(1, &mut alignment.depth[1]);
    let crops = fill_and_crop(&mut mosaic, guide.as_ref(), options, observer)?;
    timer.end(Stage::Fill, observer);

    let warnings = warnings(&alignment.geometry, &warped, &quality);
    let projection = projected.as_ref().map_or(Projection::Plane, |projected| projected.projection);
    let projected_reference = projected.map(ProjectedReference::into_image);
    let Alignment { geometry, matches, .. } = alignment;
    Ok(Stitched {
        matches,
        geometry,
        depth: [None, None],
        warped,
        mosaic,
        projection,
        projected_reference,
        crops,
        quality,
        warnings,
        times: timer.into_times(),
    })
}

/// Renders the target by an alignment, next to the reference as it is or as it is `projected`.
fn warp_aligned(
    alignment: &Alignment<'_>,
    projected: Option<&ProjectedReference>,
    [target, reference]: [View<'_>; 2],
    options: &Options,
    memory: &Memory<'_>,
    observer: &mut dyn Observer,
) -> Result<Warped> {
    let [target, reference] = alignment.views(target, reference);
    let Estimate { forward, reverse, .. } = &alignment.geometry;
    let options = WarpOptions {
        void_distance: alignment.void_distance(target.image, options.warp.void_distance),
        stretch_limit: alignment.stretch_limit(options.warp.stretch_limit, projected.is_some()),
        // Of what follows only exemplar filling uses depth, and a smooth surface has no background.
        depth: options.warp.depth
            && !alignment.smooth
            && options.fill.as_ref().is_some_and(|fill| fill.method == FillMethod::Exemplar),
        ..options.warp.clone()
    };
    let job = match projected {
        None => WarpJob::new([target, reference], forward, reverse),
        Some(projected) => {
            let [forward, reverse] = &projected.models;
            let surface = Some(projected.surface);
            WarpJob { surface, ..WarpJob::new([target, projected.view()], forward, reverse) }
        }
    };
    warp_within(&job, &options, &|canvas| memory.check(canvas), observer)
}

/// What tells background from foreground where voids are to be filled, next to the reference as it is `shown`.
fn fill_guide(
    warped: &mut Warped,
    seam: &Mask,
    alignment: &Alignment<'_>,
    projected: Option<&ProjectedReference>,
    shown: View<'_>,
    options: &Options,
) -> Result<Option<FillGuide>> {
    if options.fill.is_none() {
        return Ok(None);
    }
    let guide = FillGuide::new(warped, seam, &alignment.geometry.forward, shown)?;
    // On a projection surface parallax is along curves.
    Ok(guide.map(|guide| if projected.is_some() { FillGuide { epipole: [0.0; 3], ..guide } } else { guide }))
}

/// Fills the voids of the mosaic, if asked for, and finds its rectangles.
fn fill_and_crop(
    mosaic: &mut Mosaic,
    guide: Option<&FillGuide>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Crops> {
    if let Some(options) = &options.fill {
        fill(&mut mosaic.image, &mosaic.voids, guide, options, observer)?;
    }
    Ok(Crops { inner: crop::inner(&mosaic.image)?, bounds: crop::bounds(&mosaic.image) })
}

/// The warnings of the fit, and those that the result itself gives rise to.
fn warnings(geometry: &Estimate, warped: &Warped, quality: &Quality) -> Vec<Warning> {
    let mut warnings = geometry.warnings.clone();
    if warped.clipped {
        warnings.push(Warning::CanvasClipped);
    }
    if quality.ssim_mask < POOR_SSIM {
        warnings.push(Warning::PoorAlignment { ssim: quality.ssim_mask });
    }
    if quality.coverage < SMALL_COVERAGE {
        warnings.push(Warning::SmallOverlap { coverage: quality.coverage });
    }
    warnings
}
