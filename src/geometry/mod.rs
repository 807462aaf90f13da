//! Robust fit and epipolar geometry from matches and depth (paper, section 3.1). This module sees matches, not pixels.
//!
//! [`estimate()`] is the whole of it. One robust estimator (`ransac`) serves the homography and the depth model (`projection`)
//! and the fundamental matrix (`epipolar`); `calibrated` replaces the free models by two cameras, `multi_view` finds one geometry of
//! many photos.

mod anisotropy;
mod calibrated;
mod correspondences;
mod distortion;
mod eigen;
mod epipolar;
mod estimate;
mod homography;
mod levenberg_marquardt;
mod model;
mod multi_view;
mod normalisation;
mod plane;
mod projection;
mod ransac;
mod robust_fit;
mod summary;
mod usable;

pub use anisotropy::anisotropy;
pub(crate) use anisotropy::{MOST_ANISOTROPY, log_singular_value_ratio};
pub(crate) use distortion::{Distortion, Undistortion};
pub(crate) use eigen::eigenpairs;
pub(crate) use epipolar::{plane_at_infinity, pure_rotation, two_view_geometry};
pub use estimate::estimate;
pub use homography::homography;
pub use model::{Match, Model};
pub(crate) use model::{check_depth, check_views, epipolar_direction};
pub use multi_view::{Camera, MultiViewKind};
pub(crate) use multi_view::{Equations, Lens, MultiView, ObservedPair, PairLink, multi_view, pair_focal};
pub use plane::DepthSample;
pub(crate) use plane::{dominant_plane, plane_depth, tile_planes, weighted_plane};
pub(crate) use usable::usable_matches;

use crate::InverseDepth;
use crate::report::Warning;

/// Which robust fit selects the inliers (paper, table 2, rows 1, 2 and 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RobustFit {
    /// The paper's depth-RANSAC: six matches determine H∞ and e' at once.
    #[default]
    Depth,
    /// One homography by RANSAC.
    Homography,
    /// Several homographies, each by RANSAC on the matches that the ones before left over.
    MultiHomography,
}

/// The largest transfer error of an inlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Threshold {
    /// In pixels of the reference, with a wider retry when the consensus is weak.
    Pixels(f64),
    /// In Hartley-normalised coordinates of the reference's matches. The paper uses 0.1, without a retry.
    Normalised(f64),
}

impl Threshold {
    /// The paper's own setting.
    pub const PAPER: Threshold = Threshold::Normalised(0.1);
}

/// Whether two calibrated cameras (rotation, translation and one focal length) may replace the free model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Calibration {
    /// Never: the paper's model.
    Off,
    /// Where they explain the matches as well, given that they have fewer parameters: see [`Score`].
    #[default]
    Auto,
    /// Wherever there is parallax.
    Always,
}

/// Options of [`estimate()`].
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// How inliers are selected.
    pub robust_fit: RobustFit,
    /// The largest error of an inlier.
    pub threshold: Threshold,
    /// The probability, between 0 and 1, that at least one sample is free of outliers when sampling stops.
    pub confidence: f64,
    /// The largest number of samples to draw in a search. There may be several.
    pub max_trials: u32,
    /// Whether two calibrated cameras may replace the free model.
    pub calibration: Calibration,
    /// Focal length in pixels of the target, if known to about two per cent.
    pub focal: Option<f64>,
    /// Seed of the sampler; the same seed gives the same bytes.
    pub seed: u32,
}

impl Default for EstimateOptions {
    fn default() -> Self {
        Self {
            robust_fit: RobustFit::Depth,
            threshold: Threshold::Pixels(3.0),
            confidence: 0.99,
            max_trials: 2000,
            calibration: Calibration::Auto,
            focal: None,
            seed: 1,
        }
    }
}

/// What [`estimate()`] needs to know of one photo.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Its inverse depth, of the same size. `None`: a homography is fitted.
    pub depth: Option<&'a InverseDepth>,
}

/// Which model was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// x' ~ H∞ x̃ + e'·d(x).
    Depth,
    /// The same, of two pinhole cameras with square pixels, one focal length, and the principal points at the centres.
    Calibrated,
    /// x' ~ H x̃, with e' = 0.
    Homography,
    /// x' ~ H x̃ + e'·g(x) with relative inverse depth g from the two photos alone.
    TwoView,
}

/// How well models explain the matches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Σ min(x, 9) over all usable matches and both directions, x the squared error in standard deviations: of the points
    /// across the epipolar line, of the inverse depth along it.
    pub cost: f64,
    /// The penalty of the models' parameters: k·ln 4n, with k = 22 free or 10 calibrated parameters and n matches of four
    /// coordinates (Bayesian information criterion).
    pub penalty: f64,
}

impl Score {
    /// The smaller, the better.
    pub fn total(&self) -> f64 {
        self.cost + self.penalty
    }
}

/// Free against calibrated models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// H∞ and e' of each direction by themselves.
    pub free: Score,
    /// Two cameras.
    pub calibrated: Score,
    /// Whether the depth, judged by the cameras, is about as accurate as the matches.
    pub exact: bool,
}

/// Both models and how they were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Target to reference.
    pub forward: Model,
    /// Reference to target.
    pub reverse: Model,
    /// One flag per match passed, in the same order.
    pub inliers: Vec<bool>,
    /// Which model was fitted.
    pub kind: ModelKind,
    /// Matches left once non-finite, out-of-frame, duplicated and depthless ones are dropped.
    pub usable: usize,
    /// Correspondences tracked over the overlap that were fitted besides the matches: of [`align`](crate::pipeline::align) only.
    pub tracked: usize,
    /// The threshold of the inliers, in pixels of the reference.
    pub threshold: f64,
    /// Samples drawn, in total.
    pub trials: u32,
    /// Median transfer error of the inliers in pixels, forward and reverse; the tracked points included.
    pub residual: [f64; 2],
    /// Focal length in pixels of the target: of calibrated models, and of a camera that only turned. The reference's is the same share of its diagonal.
    pub focal: Option<f64>,
    /// How the free and the calibrated models compare, if both were fitted.
    pub comparison: Option<Comparison>,
    /// What the user should know about the fit.
    pub warnings: Vec<Warning>,
}

impl Estimate {
    /// A homography for want of parallax, not of depth.
    pub(crate) fn without_parallax(mut self) -> Self {
        for warning in &mut self.warnings {
            if *warning == Warning::NoDepth {
                *warning = Warning::ParallaxUnobservable;
            }
        }
        self
    }

    /// Those of the `matches` it was fitted to that are inliers.
    pub(crate) fn inliers_of<'a>(&'a self, matches: &'a [Match]) -> impl Iterator<Item = &'a Match> {
        matches.iter().zip(&self.inliers).filter(|(_, inlier)| **inlier).map(|(m, _)| m)
    }
}
