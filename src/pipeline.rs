//! The whole way, stage by stage (paper, algorithm 3).

use crate::geometry::{Estimate, EstimateOptions, Frame, Match, estimate};
use crate::metrics::{Quality, quality};
use crate::mosaic::{FillOptions, Mosaic, blend, fill};
use crate::observer::{Observer, report};
use crate::report::Warning;
use crate::warp::{View, WarpOptions, Warped, check_budget, warp};
use crate::{Result, Stage};

/// Below this SSIM over the valid overlap the two photos hardly show the same thing.
const POOR_SSIM: f64 = 0.35;
/// Below this share of the reference the overlap says little about the alignment.
const SMALL_COVERAGE: f64 = 0.05;

/// Options of every stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Robust fit and refinement.
    pub estimate: EstimateOptions,
    /// Rendering.
    pub warp: WarpOptions,
    /// Filling of inner voids; `None` leaves them transparent.
    pub fill: Option<FillOptions>,
}

impl Default for Options {
    fn default() -> Self {
        Self { estimate: Default::default(), warp: Default::default(), fill: Some(Default::default()) }
    }
}

/// Everything that [`stitch`] finds out and makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// Both models, and how they were found.
    pub geometry: Estimate,
    /// The target in the reference's view.
    pub warped: Warped,
    /// Both photos together, voids filled if asked for.
    pub mosaic: Mosaic,
    /// Agreement over the overlap.
    pub quality: Quality,
    /// What a person should know, the fit's own warnings first.
    pub warnings: Vec<Warning>,
    /// Milliseconds per stage, by the observer's clock.
    pub times: Vec<(Stage, f64)>,
}

/// Stitches `target` onto `reference`.
///
/// # Errors
/// Those of the stages: see [`estimate`], [`warp`], [`quality`], [`blend`] and [`fill`].
pub fn stitch(
    matches: &[Match],
    target: View<'_>,
    reference: View<'_>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Stitched> {
    let mut times = Vec::new();
    let mut start = observer.now();
    let mut lap = |stage: Stage, observer: &mut dyn Observer| {
        let now = observer.now();
        times.push((stage, now - start));
        start = now;
    };

    let geometry = estimate(matches, target.frame(), reference.frame(), &options.estimate, observer)?;
    lap(Stage::Estimate, observer);
    let warped = warp(target, reference, &geometry.forward, &geometry.reverse, &options.warp, observer)?;
    lap(Stage::Warp, observer);
    report(observer, Stage::Measure, 0.0)?;
    let quality = quality(&warped, reference.image)?;
    lap(Stage::Measure, observer);
    report(observer, Stage::Blend, 0.0)?;
    let mut mosaic = blend(&warped, reference.image)?;
    lap(Stage::Blend, observer);
    if let Some(options) = &options.fill {
        fill(&mut mosaic.image, &mosaic.voids, options, observer)?;
    }
    lap(Stage::Fill, observer);

    let warnings = remarks(&geometry, &warped, &quality);
    Ok(Stitched { geometry, warped, mosaic, quality, warnings, times })
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
