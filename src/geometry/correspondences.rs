//! Matches of one direction, and projection matrices.

use std::ops::Deref;

use nalgebra::Matrix3x4;

use super::usable::flagged;

/// A 3×4 matrix [H | e] that maps (x, y, 1, d) to the other photo: a camera, when (x, y, 1, d) is read as a
/// homogeneous point of space. Its last column is zero for a homography.
pub(super) type ProjectionMatrix = Matrix3x4<f64>;

/// A match of one direction: source point x, y, its inverse depth d, destination point u, v.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correspondence {
    pub x: f64,
    pub y: f64,
    pub d: f64,
    pub u: f64,
    pub v: f64,
}

impl Correspondence {
    /// Third coordinate of the image, positive in front of the camera.
    pub fn third(&self, p: &ProjectionMatrix) -> f64 {
        transform(p, self.x, self.y, self.d)[2]
    }
}

/// Matches of one direction.
#[derive(Debug, Clone, Default)]
pub(super) struct Correspondences(Vec<Correspondence>);

impl Deref for Correspondences {
    type Target = [Correspondence];

    fn deref(&self) -> &[Correspondence] {
        &self.0
    }
}

impl FromIterator<Correspondence> for Correspondences {
    fn from_iter<I: IntoIterator<Item = Correspondence>>(points: I) -> Self {
        Self(points.into_iter().collect())
    }
}

impl Correspondences {
    pub fn push(&mut self, [x, y]: [f64; 2], d: f64, [u, v]: [f64; 2]) {
        self.0.push(Correspondence { x, y, d, u, v });
    }

    /// The matches whose flag is set.
    pub fn select(&self, flags: &[bool]) -> Correspondences {
        Self(flagged(self, flags))
    }

    /// Every n-th match, at most `most` of them.
    pub fn subsample(&self, most: usize) -> Correspondences {
        let step = self.len().div_ceil(most).max(1);
        self.iter().step_by(step).copied().collect()
    }
}

/// Homogeneous image of (x, y, 1, d).
#[inline(always)]
pub(super) fn transform(p: &ProjectionMatrix, x: f64, y: f64, d: f64) -> [f64; 3] {
    let row = |r: usize| p[(r, 0)] * x + p[(r, 1)] * y + p[(r, 2)] + p[(r, 3)] * d;
    [row(0), row(1), row(2)]
}
