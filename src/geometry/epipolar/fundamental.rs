//! The fundamental matrix and how it is fitted.

use nalgebra::{Matrix3, Vector3};

use super::refine::refine;
use super::seven_point::{SAMPLE, seven_point};
use crate::geometry::correspondences::{Correspondence, Correspondences};
use crate::geometry::ransac::Estimator;
use crate::geometry::ransac::score::{Residual, count};

/// Where least squares stop while the inliers still change, and in the end.
pub(super) const COARSE: f64 = 1e-2;
pub(super) const FINE: f64 = 1e-9;

/// Maps a point of the target to its epipolar line in the reference, uᵀFx = 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fundamental(pub Matrix3<f64>);

impl Fundamental {
    /// The epipole in the reference, of length 1; `None` if F has not rank 2.
    pub fn epipole(&self) -> Option<Vector3<f64>> {
        // With rank 2, every column of the cofactors is a multiple of it.
        let cofactors = cofactors(&self.0);
        let longest = cofactors.column_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
        let length = longest.norm();
        (length > 0.0 && length.is_finite()).then(|| longest / length)
    }
}

/// The cofactors of M: its inverse transposed times its determinant, and the gradient of that.
pub(super) fn cofactors(m: &Matrix3<f64>) -> Matrix3<f64> {
    let [a, b, c] = [0, 1, 2].map(|i| m.column(i).into_owned());
    Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

/// Sampson distances: to first order, how far both points together must move to meet the epipolar constraint.
impl Residual for Fundamental {
    #[inline(always)]
    fn squared_error(&self, p: &Correspondence) -> f64 {
        let f = &self.0;
        let line = |r: usize| f[(r, 0)] * p.x + f[(r, 1)] * p.y + f[(r, 2)];
        let back = |c: usize| f[(0, c)] * p.u + f[(1, c)] * p.v + f[(2, c)];
        let (a, b, c, d, e) = (line(0), line(1), line(2), back(0), back(1));
        let s = a * p.u + b * p.v + c;
        s * s / (a * a + b * b + d * d + e * e)
    }
}

/// Fits a fundamental matrix to seven matches or more.
pub(super) struct FundamentalEstimator;

impl Estimator for FundamentalEstimator {
    type Model = Fundamental;

    fn sample_size(&self) -> usize {
        SAMPLE
    }

    fn fit_minimal(&self, points: &Correspondences, sample: &[usize]) -> Vec<Fundamental> {
        let mut found = seven_point(points, sample);
        found.retain(|f| oriented(points, sample, f));
        found
    }

    fn refit(&self, points: &Correspondences, inliers: &[bool], model: &Fundamental) -> Option<Fundamental> {
        self.refine(points, inliers, model, COARSE)
    }

    fn refine(
        &self,
        points: &Correspondences,
        inliers: &[bool],
        start: &Fundamental,
        tolerance: f64,
    ) -> Option<Fundamental> {
        (count(inliers.iter().copied()) > SAMPLE).then(|| refine(&points.select(inliers), start, tolerance))
    }
}

/// Whether the whole sample lies on the same side of both cameras (Chum, Werner & Matas 2004).
fn oriented(points: &Correspondences, sample: &[usize], f: &Fundamental) -> bool {
    let Some(e) = f.epipole() else { return false };
    let in_front = |i: usize| {
        let Correspondence { x, y, u, v, .. } = points[i];
        (f.0 * Vector3::new(x, y, 1.0)).dot(&e.cross(&Vector3::new(u, v, 1.0))) > 0.0
    };
    let ahead = count(sample.iter().map(|&i| in_front(i)));
    ahead == 0 || ahead == sample.len()
}

/// Plane and parallax: the fundamental matrix of a known homography and two matches off its plane. Where most matches lie on
/// one plane, hardly any seven determine more than the plane (Chum, Werner & Matas 2005).
pub(super) struct PlaneAndParallax(pub Matrix3<f64>);

impl Estimator for PlaneAndParallax {
    type Model = Fundamental;

    fn sample_size(&self) -> usize {
        2
    }

    fn fit_minimal(&self, points: &Correspondences, sample: &[usize]) -> Vec<Fundamental> {
        // The line through a match and its image by the homography contains the epipole.
        let line = |i: usize| {
            let Correspondence { x, y, u, v, .. } = points[i];
            Vector3::new(u, v, 1.0).cross(&(self.0 * Vector3::new(x, y, 1.0)))
        };
        let epipole = line(sample[0]).cross(&line(sample[1]));
        vec![Fundamental(epipole.cross_matrix() * self.0)]
    }

    fn refit(&self, points: &Correspondences, inliers: &[bool], model: &Fundamental) -> Option<Fundamental> {
        FundamentalEstimator.refit(points, inliers, model)
    }

    fn refine(
        &self,
        points: &Correspondences,
        inliers: &[bool],
        start: &Fundamental,
        tolerance: f64,
    ) -> Option<Fundamental> {
        FundamentalEstimator.refine(points, inliers, start, tolerance)
    }
}
