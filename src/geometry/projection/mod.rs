//! The models of the transfer error, x' ~ H x̃ + e·d(x) (paper, equation 4) and the homography, which has e = 0.

mod consensus;
mod linear;
mod parallax;
mod refine;

pub(super) use consensus::{Consensus, anneal_to_narrowest, homographies, refine_published};
pub(super) use parallax::parallax_observable;

use super::correspondences::{Correspondence, Correspondences, ProjectionMatrix, transform};
use super::ransac::Estimator;
use super::ransac::score::{Residual, count, squared_errors};

/// A sample must vary by this fraction of all matches' variance in x, y and (depth model) d, each beyond what the ones
/// before explain: otherwise it lies in one spot, on one line or on one plane of depth, and determines nothing. Between
/// rounding (1e-15) and the closest samples of real matches.
const SAMPLE_VARIANCE: f64 = 1e-6;
/// The same for a fit to many matches, where variance need only exceed rounding errors.
const FIT_VARIANCE: f64 = 1e-10;

/// Where non-linear least squares stop while the inliers still change, and in the end.
pub(super) const COARSE: f64 = 1e-3;
pub(super) const FINE: f64 = 1e-10;

/// Transfer errors in front of the camera (paper, equation 5), infinite behind it.
impl Residual for ProjectionMatrix {
    #[inline(always)]
    fn squared_error(&self, p: &Correspondence) -> f64 {
        let [a, b, w] = transform(self, p.x, p.y, p.d);
        let reciprocal = 1.0 / w;
        let (du, dv) = (a * reciprocal - p.u, b * reciprocal - p.v);
        if w > 0.0 { du * du + dv * dv } else { f64::INFINITY }
    }
}

/// Fits the depth model (paper, algorithm 1) or a homography.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProjectionEstimator {
    /// H∞ and e', by six matches with depth.
    Depth,
    /// H, by four matches.
    Homography,
}

impl Estimator for ProjectionEstimator {
    type Model = ProjectionMatrix;

    fn sample_size(&self) -> usize {
        match self {
            Self::Depth => 6,
            Self::Homography => 4,
        }
    }

    fn fit_minimal(&self, points: &Correspondences, sample: &[usize]) -> Vec<ProjectionMatrix> {
        let Some(model) = self.linear(points, sample, SAMPLE_VARIANCE) else { return Vec::new() };
        // All of the sample must be in front of the camera, by one sign of the model or the other.
        let behind = count(sample.iter().map(|&i| points[i].third(&model) <= 0.0));
        match behind {
            0 => vec![model],
            _ if behind == sample.len() => vec![-model],
            _ => Vec::new(),
        }
    }

    fn refit(&self, points: &Correspondences, inliers: &[bool], _: &ProjectionMatrix) -> Option<ProjectionMatrix> {
        self.linear_of_most(points, inliers)
    }

    fn refine(
        &self,
        points: &Correspondences,
        inliers: &[bool],
        start: &ProjectionMatrix,
        tolerance: f64,
    ) -> Option<ProjectionMatrix> {
        self.fit(points, inliers, Some(start), tolerance)
    }
}

impl ProjectionEstimator {
    fn linear(self, points: &Correspondences, indices: &[usize], min_pivot: f64) -> Option<ProjectionMatrix> {
        match self {
            Self::Depth => linear::fit::<4>(points, indices, min_pivot),
            Self::Homography => linear::fit::<3>(points, indices, min_pivot),
        }
    }

    /// The linear fit to the flagged matches, with the sign that has most of them in front of the camera.
    fn linear_of_most(self, points: &Correspondences, inliers: &[bool]) -> Option<ProjectionMatrix> {
        let indices: Vec<usize> = inliers.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i).collect();
        let model = self.linear(points, &indices, FIT_VARIANCE)?;
        let behind = count(indices.iter().map(|&i| points[i].third(&model) < 0.0));
        Some(if 2 * behind > indices.len() { -model } else { model })
    }

    /// Least squares on the flagged matches (paper, equation 9), from `start` or the linear fit to them, whichever has the
    /// smaller error. `None` if they do not determine the model.
    pub fn fit(
        self,
        points: &Correspondences,
        inliers: &[bool],
        start: Option<&ProjectionMatrix>,
        tolerance: f64,
    ) -> Option<ProjectionMatrix> {
        let chosen = points.select(inliers);
        if chosen.len() < self.sample_size() {
            return None;
        }
        let linear = self.linear_of_most(points, inliers);
        let sum = |p: &ProjectionMatrix| squared_errors(&chosen, p).iter().sum::<f64>();
        let start = match (&linear, start) {
            (Some(linear), Some(start)) if sum(start) < sum(linear) => start,
            (linear, start) => linear.as_ref().or(start)?,
        };
        // A wrong depth can put a match behind the camera, where the error has no gradient.
        let in_front: Vec<bool> = chosen.iter().map(|p| p.third(start) > 0.0).collect();
        Some(refine::refine(&chosen.select(&in_front), start, self == Self::Depth, tolerance))
    }
}
