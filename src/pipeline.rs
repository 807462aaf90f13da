//! The whole way, stage by stage (paper, algorithm 3).

mod alignment;
mod matching;

use std::borrow::Cow;

pub use alignment::Alignment;
pub use matching::FeatureOptions;

use crate::depth::RefineOptions;
use crate::geometry::{Calibration, Estimate, EstimateOptions, Frame, Match, Threshold};
use crate::metrics::{Quality, quality};
use crate::mosaic::{BlendOptions, FillMethod, FillOptions, Guide, Mosaic, blend, crop, fill};
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::warp::{WarpOptions, Warped, check_budget, warp};
use crate::{InverseDepth, Rect, Result, Stage, View};
use alignment::fit;

/// Below this SSIM over the valid overlap the two photos hardly show the same thing.
const POOR_SSIM: f64 = 0.35;
/// Below this share of the reference the overlap says little about the alignment.
const SMALL_COVERAGE: f64 = 0.05;

/// Which defaults the options have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// This package's own.
    #[default]
    Default,
    /// The published method: its threshold, free models, depth as given, plain averages, smooth filling.
    Paper,
}

/// What is done without depth maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WithoutDepth {
    /// Depth is found from the two photos themselves.
    #[default]
    TwoView,
    /// The photos are aligned by a homography.
    Homography,
}

/// Options of every stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Features and their matches, where none are given.
    pub features: FeatureOptions,
    /// What is done without depth maps.
    pub without_depth: WithoutDepth,
    /// Robust fit and refinement.
    pub estimate: EstimateOptions,
    /// Epipolar refinement of the inverse depth; `None` takes it as it is.
    pub refine: Option<RefineOptions>,
    /// Rendering.
    pub warp: WarpOptions,
    /// Exposure, seam and blending.
    pub blend: BlendOptions,
    /// Filling of inner voids; `None` leaves them transparent.
    pub fill: Option<FillOptions>,
    /// Whether the result is to have the inverse depth that was used.
    pub output_depth: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            features: Default::default(),
            without_depth: Default::default(),
            estimate: Default::default(),
            refine: Some(Default::default()),
            warp: Default::default(),
            blend: Default::default(),
            fill: Some(Default::default()),
            output_depth: false,
        }
    }
}

impl Options {
    /// The defaults of a mode.
    pub fn of(mode: Mode) -> Self {
        match mode {
            Mode::Default => Self::default(),
            Mode::Paper => Self::paper(),
        }
    }

    /// Those of the published method.
    pub fn paper() -> Self {
        let estimate =
            EstimateOptions { threshold: Threshold::PAPER, calibration: Calibration::Off, ..Default::default() };
        Self {
            features: FeatureOptions { guided: false, ..Default::default() },
            without_depth: WithoutDepth::Homography,
            estimate,
            refine: None,
            warp: WarpOptions::paper(),
            blend: BlendOptions::paper(),
            fill: Some(FillOptions { method: FillMethod::Smooth, ..Default::default() }),
            ..Self::default()
        }
    }
}

/// Rectangles of the mosaic; `None` only where nothing is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crops {
    /// The largest one without a transparent pixel.
    pub inner: Option<Rect>,
    /// The smallest one with everything.
    pub bounds: Option<Rect>,
}

/// Everything that [`stitch`] finds out and makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// The matches that were found; `None` when they were given.
    pub matches: Option<Vec<Match>>,
    /// Both models, and how they were found.
    pub geometry: Estimate,
    /// With [`Options::output_depth`] and parallax, the inverse depth of target and reference that was used.
    pub depth: [Option<InverseDepth>; 2],
    /// The target in the reference's view.
    pub warped: Warped,
    /// Both photos together, voids filled if asked for.
    pub mosaic: Mosaic,
    /// What of the mosaic is worth keeping.
    pub crops: Crops,
    /// Agreement over the overlap.
    pub quality: Quality,
    /// What a person should know, the fit's own warnings first.
    pub warnings: Vec<Warning>,
    /// Milliseconds per stage, by the observer's clock.
    pub times: Vec<(Stage, f64)>,
}

/// Stitches `target` onto `reference`. Without `matches`, features of both photos are detected and matched.
///
/// # Errors
/// Those of the stages: see [`align`], [`warp`], [`quality`], [`blend`] and [`fill`].
pub fn stitch(
    matches: Option<&[Match]>,
    target: View<'_>,
    reference: View<'_>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Stitched> {
    let mut laps = Laps::start(observer);
    let aligned = aligned(matches, target, reference, options, observer, &mut laps)?;
    let (geometry, [target, reference]) = (&aligned.geometry, aligned.views(target, reference));
    let warping = WarpOptions {
        void_distance: aligned.void_distance(target.image, options.warp.void_distance),
        // Only what fills with pieces of the background looks at depth again.
        depth: options.warp.depth && options.fill.as_ref().is_some_and(|fill| fill.method == FillMethod::Exemplar),
        ..options.warp.clone()
    };
    let warped = warp(target, reference, &geometry.forward, &geometry.reverse, &warping, observer)?;
    laps.end(Stage::Warp, observer);
    report(observer, Stage::Measure, 0.0)?;
    let quality = quality(&warped, reference.image)?;
    laps.end(Stage::Measure, observer);
    let mut mosaic = blend(&warped, reference.image, aligned.trusted.as_ref(), &options.blend, observer)?;
    laps.end(Stage::Blend, observer);
    if let Some(options) = &options.fill {
        let guide = Guide::new(&warped, &geometry.forward, reference)?;
        fill(&mut mosaic.image, &mosaic.voids, guide.as_ref(), options, observer)?;
    }
    let crops = Crops { inner: crop::inner(&mosaic.image)?, bounds: crop::bounds(&mosaic.image) };
    laps.end(Stage::Fill, observer);

    let warnings = remarks(geometry, &warped, &quality);
    let Alignment { geometry, depth, matches, .. } = aligned;
    Ok(Stitched {
        matches,
        geometry,
        depth: depth.map(|map| map.filter(|_| options.output_depth).map(Cow::into_owned)),
        warped,
        mosaic,
        crops,
        quality,
        warnings,
        times: laps.times,
    })
}

/// The first half of [`stitch`]: matches, models and the inverse depth that goes with them, refined.
///
/// # Errors
/// Those of the stages: see [`detect`](crate::features::detect), [`match_features`](crate::features::match_features),
/// [`estimate`](crate::geometry::estimate), [`two_view`](crate::depth::two_view) and [`refine`](crate::depth::refine).
pub fn align<'a>(
    matches: Option<&[Match]>,
    target: View<'a>,
    reference: View<'a>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Alignment<'a>> {
    let mut laps = Laps::start(observer);
    aligned(matches, target, reference, options, observer, &mut laps)
}

fn aligned<'a>(
    given: Option<&[Match]>,
    target: View<'a>,
    reference: View<'a>,
    options: &Options,
    observer: &mut dyn Observer,
    laps: &mut Laps,
) -> Result<Alignment<'a>> {
    let mut aligned = if let Some(matches) = given {
        let aligned = fit(matches, target, reference, options, observer)?;
        laps.end(aligned.stage(), observer);
        aligned
    } else {
        let features = matching::detect_both(target.image, reference.image, &options.features, observer)?;
        laps.end(Stage::Detect, observer);
        let found = matching::match_both(features, &options.features, observer)?;
        laps.end(Stage::Match, observer);
        let mut aligned = fit(&found.matches, target, reference, options, observer)?;
        laps.end(aligned.stage(), observer);
        let mut matches = None;
        if options.features.guided {
            let more = matching::match_again(&found, &aligned, &options.features, observer)?;
            laps.end(Stage::Match, observer);
            let again = fit(&more, target, reference, options, observer)?;
            let threshold = aligned.geometry.threshold;
            if again.cost(&more, threshold) < aligned.cost(&more, threshold) {
                (aligned, matches) = (again, Some(more));
            }
            laps.end(aligned.stage(), observer);
        }
        Alignment { matches: matches.or(Some(found.matches)), ..aligned }
    };
    if let Some(options) = &options.refine {
        aligned.refine(given, target, reference, options, observer)?;
        laps.end(Stage::Refine, observer);
    }
    Ok(aligned)
}

/// Milliseconds per stage; a stage that is gone through twice counts once.
struct Laps {
    times: Vec<(Stage, f64)>,
    start: f64,
}

impl Laps {
    fn start(observer: &mut dyn Observer) -> Self {
        Self { times: Vec::new(), start: observer.now() }
    }

    /// Counts the time since the last end, or the start, for `stage`.
    fn end(&mut self, stage: Stage, observer: &mut dyn Observer) {
        let now = observer.now();
        match self.times.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, ms)) => *ms += now - self.start,
            None => self.times.push((stage, now - self.start)),
        }
        self.start = now;
    }
}

/// Refuses photos for which even the inputs and the forward map would exceed `limit` bytes. The canvas is checked by
/// [`warp`], once its size is known.
///
/// # Errors
/// `too-large` for the larger photo.
pub fn check_input_sizes(target: (usize, usize), reference: (usize, usize), limit: u64) -> Result<()> {
    const PHOTO_AND_DEPTH: u64 = 4 + 4;
    const VERTICES: u64 = 8;
    let pixels = |(w, h): (usize, usize)| (w as u64).saturating_mul(h as u64);
    let target_bytes = pixels(target).saturating_mul(PHOTO_AND_DEPTH + VERTICES);
    let reference_bytes = pixels(reference).saturating_mul(PHOTO_AND_DEPTH);
    if pixels(target) >= pixels(reference) {
        check_budget(target.0 as u64, target.1 as u64, PHOTO_AND_DEPTH + VERTICES, reference_bytes, limit)
    } else {
        check_budget(reference.0 as u64, reference.1 as u64, PHOTO_AND_DEPTH, target_bytes, limit)
    }
}

impl<'a> View<'a> {
    fn frame(&self) -> Frame<'a> {
        Frame { size: (self.image.width(), self.image.height()), depth: self.depth }
    }
}

fn remarks(geometry: &Estimate, warped: &Warped, quality: &Quality) -> Vec<Warning> {
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
