//! Options of every stage, with the defaults of this package and those of the published method.

use super::features::FeatureOptions;
use crate::Result;
use crate::depth::RefineOptions;
use crate::geometry::{Calibration, EstimateOptions, Threshold};
use crate::mosaic::{BlendOptions, FillMethod, FillOptions};
use crate::warp::{Projection, WarpOptions};

/// Which defaults the options have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// This package's own.
    #[default]
    Default,
    /// The published method: its threshold, uncalibrated models, depth as given, plain averages, smooth filling.
    Paper,
}

/// What to do without depth maps, or when the ones given do not fit the matches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WithoutDepth {
    /// Estimate depth from the two photos themselves.
    #[default]
    TwoView,
    /// Align the photos by a homography.
    Homography,
}

/// Options of every stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Feature detection and matching, used when no matches are given.
    pub features: FeatureOptions,
    /// What to do without depth maps.
    pub without_depth: WithoutDepth,
    /// Robust fit and its refinement.
    pub estimate: EstimateOptions,
    /// Epipolar refinement of the inverse depth; `None` takes it as it is.
    pub refine: Option<RefineOptions>,
    /// Rendering.
    pub warp: WarpOptions,
    /// What photos are shown on; `None` for whatever suits the field of view. On a plane the reference stays as it is, and two photos
    /// are shown on it unless it stretches the target very much. More photos of a flat scene, whose cameras are not known, are always
    /// shown on a plane.
    pub projection: Option<Projection>,
    /// Exposure, seam and blending.
    pub blend: BlendOptions,
    /// Filling of inner voids; `None` leaves them transparent.
    pub fill: Option<FillOptions>,
    /// Whether the result should contain the inverse depth that was used.
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
            projection: None,
            blend: Default::default(),
            fill: Some(Default::default()),
            output_depth: false,
        }
    }
}

impl Options {
    /// Refuses what rendering could not use, before anything is computed for it.
    ///
    /// # Errors
    /// `invalid-argument`.
    pub(super) fn check(&self) -> Result<()> {
        self.warp.check()?;
        self.blend.check()?;
        self.fill.as_ref().map_or(Ok(()), FillOptions::check)
    }

    /// The defaults of a mode.
    pub fn of(mode: Mode) -> Self {
        match mode {
            Mode::Default => Self::default(),
            Mode::Paper => Self::paper(),
        }
    }

    /// The defaults of the published method.
    pub fn paper() -> Self {
        let estimate =
            EstimateOptions { threshold: Threshold::PAPER, calibration: Calibration::Off, ..Default::default() };
        Self {
            features: FeatureOptions { guided: false, ..Default::default() },
            without_depth: WithoutDepth::Homography,
            estimate,
            refine: None,
            warp: WarpOptions::paper(),
            projection: Some(Projection::Plane),
            blend: BlendOptions::paper(),
            fill: Some(FillOptions { method: FillMethod::Smooth, ..Default::default() }),
            ..Self::default()
        }
    }
}
