//! The map from one photo to the other, and the matches that determine it.

use nalgebra::{Matrix3, Vector3};

use crate::image::check_size;
use crate::{Error, Result, View};

/// A point of the target and the point of the reference that shows the same scene point, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// x, y in the target.
    pub target: [f64; 2],
    /// x, y in the reference.
    pub reference: [f64; 2],
}

/// The map x' ~ H x̃ + e·d(x) (paper, equation 4), its sign such that the third coordinate is positive in front of
/// the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Infinite homography H∞ (up to a multiple of e·[0 0 1], as d is known only up to an affine change).
    pub h: Matrix3<f64>,
    /// Epipole e', scaled with d. Zero for a homography.
    pub e: Vector3<f64>,
}

impl Model {
    /// A homography: no parallax.
    ///
    /// ```
    /// use depthstitch::geometry::Model;
    /// use nalgebra::Matrix3;
    ///
    /// // Twice the size, and 10 pixels to the right. Depth plays no part.
    /// let model = Model::homography(Matrix3::new(2.0, 0.0, 10.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0));
    /// assert_eq!(model.project(3.0, 4.0, 0.5), Some([16.0, 8.0]));
    /// ```
    pub fn homography(h: Matrix3<f64>) -> Self {
        Self { h, e: Vector3::zeros() }
    }

    /// The model of the other direction, (H⁻¹, −H⁻¹e): inverse depth d with the third coordinate λ here is d/λ there. `None`
    /// if H has no inverse.
    pub fn inverse(&self) -> Option<Self> {
        let h = self.h.try_inverse()?;
        let inverse = Self { h, e: -(h * self.e) };
        inverse.is_finite().then_some(inverse)
    }

    /// Whether the map depends on depth, that is e' ≠ 0.
    pub fn has_parallax(&self) -> bool {
        self.e != Vector3::zeros()
    }

    /// Whether all entries are finite.
    pub fn is_finite(&self) -> bool {
        self.first_not_finite().is_none()
    }

    fn first_not_finite(&self) -> Option<f64> {
        self.h.as_slice().iter().chain(self.e.as_slice()).copied().find(|v| !v.is_finite())
    }

    /// Refuses entries that are not finite.
    ///
    /// # Errors
    /// `invalid-argument`.
    pub(crate) fn check(&self) -> Result<()> {
        self.first_not_finite().map_or(Ok(()), |value| {
            Err(Error::InvalidArgument { name: "model", expected: "of finite numbers", value }.into())
        })
    }

    /// Homogeneous image of (x, y) with inverse depth d. The point is in front of the camera if the third coordinate is
    /// positive.
    #[inline]
    pub fn transform(&self, x: f64, y: f64, d: f64) -> [f64; 3] {
        let (h, e) = (&self.h, &self.e);
        [
            h[(0, 0)] * x + h[(0, 1)] * y + h[(0, 2)] + e[0] * d,
            h[(1, 0)] * x + h[(1, 1)] * y + h[(1, 2)] + e[1] * d,
            h[(2, 0)] * x + h[(2, 1)] * y + h[(2, 2)] + e[2] * d,
        ]
    }

    /// Distance in pixels between the image of (x, y) with inverse depth d and the point that it was matched with (paper,
    /// equation 5). `None` behind the camera.
    pub fn transfer_error(&self, [x, y]: [f64; 2], d: f64, [u, v]: [f64; 2]) -> Option<f64> {
        self.project(x, y, d).map(|[a, b]| ((a - u) * (a - u) + (b - v) * (b - v)).sqrt())
    }

    /// Distance in pixels of a point of the other photo from the epipolar line of (x, y), which no inverse depth can reduce.
    /// `None` without a line: without parallax, or at the epipole.
    pub fn epipolar_distance(&self, [x, y]: [f64; 2], [u, v]: [f64; 2]) -> Option<f64> {
        let line = self.e.cross(&(self.h * Vector3::new(x, y, 1.0)));
        let length = (line[0] * line[0] + line[1] * line[1]).sqrt();
        (length > 0.0).then(|| (line[0] * u + line[1] * v + line[2]).abs() / length)
    }

    /// The inverse depth of (x, y) that projects it to the point of its epipolar line closest to its match (u, v). `None` without
    /// parallax, and at the epipole.
    ///
    /// ```
    /// use depthstitch::geometry::Model;
    /// use nalgebra::{Matrix3, Vector3};
    ///
    /// // Ten pixels to the right per unit of inverse depth.
    /// let model = Model { h: Matrix3::identity(), e: Vector3::new(10.0, 0.0, 0.0) };
    /// assert_eq!(model.project(3.0, 4.0, 2.0), Some([23.0, 4.0]));
    /// assert_eq!(model.triangulate([3.0, 4.0], [23.0, 5.0]), Some(2.0));
    /// assert_eq!(Model::homography(model.h).triangulate([3.0, 4.0], [23.0, 5.0]), None);
    /// ```
    pub fn triangulate(&self, [x, y]: [f64; 2], [u, v]: [f64; 2]) -> Option<f64> {
        let far = self.h * Vector3::new(x, y, 1.0);
        let line = self.e.cross(&far);
        let offset = (line[0] * u + line[1] * v + line[2]) / (line[0] * line[0] + line[1] * line[1]);
        let place = Vector3::new(u - offset * line[0], v - offset * line[1], 1.0);
        let across = place.cross(&self.e);
        let depth = -across.dot(&place.cross(&far)) / across.norm_squared();
        depth.is_finite().then_some(depth)
    }

    /// By how many pixels the image of (x, y) moves per unit of inverse depth, at d: |∂x'/∂d|.
    pub fn parallax(&self, [x, y]: [f64; 2], d: f64) -> f64 {
        let [u, v, w] = self.transform(x, y, d);
        let [du, dv] = depth_derivative(&self.e, [u / w, v / w], w);
        (du * du + dv * dv).sqrt()
    }

    /// Image of (x, y) with inverse depth d in pixels, or `None` behind the camera.
    #[inline]
    pub fn project(&self, x: f64, y: f64, d: f64) -> Option<[f64; 2]> {
        let [u, v, w] = self.transform(x, y, d);
        (w > 0.0).then(|| [u / w, v / w])
    }
}

/// ∂x'/∂d of a point that is projected to `place` with the third coordinate `w`, by the epipole `e`: (e − e₃ x̃')/w.
#[inline(always)]
pub(super) fn depth_derivative(e: &Vector3<f64>, [x, y]: [f64; 2], w: f64) -> [f64; 2] {
    epipolar_direction(e, [x, y, 1.0]).map(|slope| slope / w)
}

/// Where the projection of the homogeneous point (u, v, w) moves along its epipolar line as inverse depth grows, by the
/// epipole `e`: w e − e₃ x̃', which is w²·∂x'/∂d by the quotient rule. Divided by w, that is with `[x, y, 1]`: w·∂x'/∂d.
#[inline(always)]
pub(crate) fn epipolar_direction(e: &Vector3<f64>, [u, v, w]: [f64; 3]) -> [f64; 2] {
    [e[0] * w - u * e[2], e[1] * w - v * e[2]]
}

/// Checks models, sizes, and that there is depth where there is parallax.
pub(crate) fn check_views(target: &View<'_>, reference: &View<'_>, forward: &Model, reverse: &Model) -> Result<()> {
    check_depth("targetDepth", target, forward)?;
    check_depth("referenceDepth", reference, reverse)
}

/// The same for one photo and the model that leads from it to the other.
pub(crate) fn check_depth(name: &'static str, view: &View<'_>, model: &Model) -> Result<()> {
    model.check()?;
    match view.depth {
        Some(depth) => check_size(name, depth.size(), view.image.size()),
        None if model.has_parallax() => Err(Error::Missing { name, reason: "the model has parallax" }.into()),
        None => Ok(()),
    }
}
