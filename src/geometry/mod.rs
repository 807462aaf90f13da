//! Robust fit and epipolar geometry from matches and depth (paper, section 3.1).

mod clean;
mod consensus;
mod estimate;
mod linear;
mod model;
mod parallax;
mod points;
mod ransac;
mod refine;
mod sampler;
mod statistics;

pub use estimate::estimate;
pub use model::{Match, Model};

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
    /// x' ~ H x̃, with e' = 0.
    Homography,
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
    /// The threshold that chose the inliers, in pixels of the reference.
    pub threshold: f64,
    /// Samples drawn, all passes together.
    pub trials: u32,
    /// Median transfer error of the inliers in pixels, forward and reverse.
    pub residual: [f64; 2],
    /// What a person should know about the fit.
    pub warnings: Vec<Warning>,
}
