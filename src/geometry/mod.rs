//! Robust fit and epipolar geometry from matches and depth (paper, section 3.1).

mod calibration;
mod cameras;
mod clean;
mod consensus;
mod epipolar;
mod errors;
mod estimate;
mod homography;
mod levenberg_marquardt;
mod linear;
mod model;
mod parallax;
mod plane;
mod points;
mod ransac;
mod refine;
mod reprojection;
mod vectors;

pub(crate) use epipolar::two_view_geometry;
pub use estimate::estimate;
pub use homography::homography;
pub(crate) use model::check_views;
pub use model::{Match, Model};
pub use plane::DepthSample;
pub(crate) use plane::{at, dominant_plane};

use crate::InverseDepth;
use crate::report::Warning;

/// Which robust fit picks the inliers (paper, table 2, rows 1, 2 and 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RobustFit {
    /// The paper's depth-RANSAC: six matches fix H∞ and e' at once.
    #[default]
    Depth,
    /// One homography by RANSAC.
    Homography,
    /// Several homographies, each by RANSAC on what the ones before left over.
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

/// Whether the model of two calibrated cameras, rotation, translation and one focal length, may replace the free one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Calibration {
    /// Never: the paper's model.
    Off,
    /// When it explains the matches as well, less what fewer numbers must be expected to explain less.
    #[default]
    Auto,
    /// Wherever there is parallax.
    Always,
}

/// Options of [`estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// What picks the inliers.
    pub robust_fit: RobustFit,
    /// The largest error of an inlier.
    pub threshold: Threshold,
    /// The chance, 0 to 1, that at least one sample was free of outliers when sampling stops.
    pub confidence: f64,
    /// Most samples to draw.
    pub max_trials: u32,
    /// Whether two calibrated cameras may replace the free model.
    pub calibration: Calibration,
    /// Focal length in pixels of the target, when known to about two per cent.
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

/// What [`estimate`] needs to know of one photo.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Its inverse depth, of the same size. `None`: a homography is fitted.
    pub depth: Option<&'a InverseDepth>,
}

/// Whether parallax is part of the model.
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
    /// What the models' numbers cost: k·ln 4n, with k = 22 free or 10 calibrated numbers and n matches of four coordinates
    /// (Bayesian information criterion).
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
    /// Whether the depth, by the cameras, errs hardly more than the matches.
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
    /// Whether parallax is part of the models.
    pub kind: ModelKind,
    /// Matches left once non-finite, out-of-frame, duplicated and depthless ones are dropped.
    pub usable: usize,
    /// Points followed over the overlap that were fitted besides the matches: of [`align`](crate::pipeline::align) only.
    pub followed: usize,
    /// The threshold that chose the inliers, in pixels of the reference.
    pub threshold: f64,
    /// Samples drawn, all passes together.
    pub trials: u32,
    /// Median transfer error of the inliers in pixels, forward and reverse; of the points followed as well.
    pub residual: [f64; 2],
    /// Focal length in pixels of the target: of calibrated models only. The reference's is the same share of its diagonal.
    pub focal: Option<f64>,
    /// How the free and the calibrated models compared, when both were fitted.
    pub comparison: Option<Comparison>,
    /// What a person should know about the fit.
    pub warnings: Vec<Warning>,
}
