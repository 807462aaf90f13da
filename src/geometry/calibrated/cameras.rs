//! Two pinhole cameras: rotation, translation and one focal length, instead of any H∞ and e'.
//!
//! Square pixels, the principal point at the centre of each photo, and the same focal length as a fraction of the photo's
//! diagonal. In coordinates from the centre, in diagonals, with ρ = (x, y, f) the ray of a point and d its normalised
//! inverse depth,
//!
//!   ρ' ~ R ρ + t (d − s),   ρ ~ Rᵀ (ρ' − κ t (d' − s')).
//!
//! The inverse depths s and s' at infinity and the ratio κ of the units of d' and d are what a relative depth leaves open.
//! With them, H∞ = K'RK⁻¹ − s e'·[0 0 1] (compare the paper's equations 3 and 4). The ten parameters R, t, ln f, s, κ and
//! s' determine the maps of both directions, which have 22 otherwise.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::geometry::correspondences::ProjectionMatrix;

/// The number of parameters, in this order: rotation (3, from the left), translation (3), ln f, s, κ, s'.
pub(in crate::geometry) const PARAMETERS: usize = 10;

/// Two cameras.
#[derive(Debug, Clone, Copy)]
pub(in crate::geometry) struct Cameras {
    pub rotation: Matrix3<f64>,
    pub translation: Vector3<f64>,
    /// ln f, f in diagonals.
    pub log_focal: f64,
    /// s and s'.
    pub shift: [f64; 2],
    /// κ.
    pub ratio: f64,
}

impl Cameras {
    pub fn focal(&self) -> f64 {
        libm::exp(self.log_focal)
    }

    /// Target to reference, and reference to target.
    pub fn projections(&self) -> [ProjectionMatrix; 2] {
        let focal = self.focal();
        [
            projection(&self.rotation, &self.translation, focal, self.shift[0]),
            projection(&self.rotation.transpose(), &self.reverse_translation(), focal, self.shift[1]),
        ]
    }

    /// −κ Rᵀt.
    pub fn reverse_translation(&self) -> Vector3<f64> {
        self.rotation.tr_mul(&self.translation) * -self.ratio
    }

    /// The cameras of this focal length nearest to the maps of both directions; `None` if there are none.
    pub fn nearest([forward, reverse]: [&ProjectionMatrix; 2], focal: f64) -> Option<Self> {
        let (rotation, translation, shift) = decompose(forward, focal)?;
        let (_, reverse_translation, reverse_shift) = decompose(reverse, focal)?;
        let expected = rotation.tr_mul(&translation);
        let ratio = -expected.dot(&reverse_translation) / expected.norm_squared();
        let shift = [shift, reverse_shift];
        (ratio + shift[0] + shift[1]).is_finite().then(|| Self {
            rotation,
            translation,
            log_focal: libm::log(focal),
            shift,
            ratio,
        })
    }

    /// By a step of the parameters.
    pub fn moved(&self, step: &SVector<f64, PARAMETERS>) -> Self {
        Self {
            rotation: small_rotation(step.fixed_rows::<3>(0).into_owned()) * self.rotation,
            translation: self.translation + step.fixed_rows::<3>(3),
            log_focal: self.log_focal + step[6],
            shift: [self.shift[0] + step[7], self.shift[1] + step[9]],
            ratio: self.ratio + step[8],
        }
    }
}

/// Rotation, t and s: the columns of diag(1, 1, f)·p are λ r₁, λ r₂, λ (f r₃ − s t) and λ t.
fn decompose(p: &ProjectionMatrix, focal: f64) -> Option<(Matrix3<f64>, Vector3<f64>, f64)> {
    let scaled = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, focal)) * p;
    let scale = (scaled.column(0).norm() * scaled.column(1).norm()).sqrt();
    let columns = scaled / scale;
    let column = |c: usize| columns.column(c).into_owned();
    let rotation = nearest_rotation(Matrix3::from_columns(&[column(0), column(1), column(0).cross(&column(1))]))?;
    let translation = column(3);
    let shifted = rotation.column(2) * focal - column(2);
    Some((rotation, translation, shifted.dot(&translation) / translation.norm_squared()))
}

/// The rotation nearest to a multiple of this matrix, the orthogonal factor of its polar decomposition, by Newton's iteration A ← ½(A + A⁻ᵀ) (Higham
/// 1986). `None` of a reflection, and of what is nearly singular.
pub(in crate::geometry) fn nearest_rotation(matrix: Matrix3<f64>) -> Option<Matrix3<f64>> {
    const ITERATIONS: usize = 20;
    let determinant = matrix.determinant();
    if determinant.is_nan() || determinant <= 1e-9 * matrix.norm().powi(3) {
        return None;
    }
    let mut a = matrix / libm::exp(libm::log(determinant) / 3.0);
    for _ in 0..ITERATIONS {
        a = (a + a.try_inverse()?.transpose()) * 0.5;
    }
    Some(a)
}

fn projection(rotation: &Matrix3<f64>, t: &Vector3<f64>, focal: f64, shift: f64) -> ProjectionMatrix {
    let third = rotation.column(2) * focal - t * shift;
    let columns = [rotation.column(0).into_owned(), rotation.column(1).into_owned(), third, *t];
    // From ρ' to coordinates.
    Matrix3::from_diagonal(&Vector3::new(focal, focal, 1.0)) * ProjectionMatrix::from_columns(&columns)
}

/// The rotation of the unit quaternion along (1, ω/2), which is exp([ω]×) up to the third order.
pub(in crate::geometry) fn small_rotation(omega: Vector3<f64>) -> Matrix3<f64> {
    let half = omega * 0.5;
    let cross = half.cross_matrix();
    Matrix3::identity() + (cross + cross * cross) * (2.0 / (1.0 + half.norm_squared()))
}
