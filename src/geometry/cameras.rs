//! Two pinhole cameras: rotation, translation and one focal length, instead of any H∞ and e'.
//!
//! Square pixels, the principal point at the centre of each photo, and the same focal length as a share of the photo's
//! diagonal. In coordinates from the centre, in diagonals, with ρ = (x, y, f) the ray of a point and d its normalised
//! inverse depth,
//!
//!   ρ' ~ R ρ + t (d − s),   ρ ~ Rᵀ (ρ' − κ t (d' − s')).
//!
//! The inverse depths s and s' at infinity and the ratio κ of the units of d' and d are what a relative depth leaves open.
//! With them, H∞ = K'RK⁻¹ − s e'·[0 0 1]. The ten numbers R, t, ln f, s, κ and s' fix the maps of both directions, which
//! take 22 otherwise.

use super::levenberg_marquardt::NUMBERS;
use super::points::Projection;
use super::vectors::cofactors;
pub(super) use super::vectors::{Matrix as Rotation, Vector, added, apply as rotated, cross, dot, transposed};

/// Two cameras.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cameras {
    pub rotation: Rotation,
    pub translation: Vector,
    /// ln f, f in diagonals.
    pub log_focal: f64,
    /// s and s'.
    pub shift: [f64; 2],
    /// κ.
    pub ratio: f64,
}

impl Cameras {
    /// How many numbers a step changes, in this order: rotation (3, from the left), translation (3), ln f, s, κ, s'.
    pub const FREE: usize = 10;

    pub fn focal(&self) -> f64 {
        libm::exp(self.log_focal)
    }

    /// Target to reference, and reference to target.
    #[inline(never)]
    pub fn projections(&self) -> [Projection; 2] {
        let (back, focal) = (transposed(&self.rotation), self.focal());
        [
            projection(&self.rotation, self.translation, focal, self.shift[0]),
            projection(&back, self.reverse_translation(), focal, self.shift[1]),
        ]
    }

    /// −κ Rᵀt.
    pub fn reverse_translation(&self) -> Vector {
        rotated(&transposed(&self.rotation), self.translation).map(|v| -self.ratio * v)
    }

    /// The cameras of this focal length nearest to the maps of both directions; `None` when there are none.
    pub fn near([forward, reverse]: [&Projection; 2], focal: f64) -> Option<Self> {
        let (rotation, translation, shift) = decomposed(forward, focal)?;
        let (_, back, reverse_shift) = decomposed(reverse, focal)?;
        let expected = rotated(&transposed(&rotation), translation);
        let ratio = -dot(expected, back) / dot(expected, expected);
        let shift = [shift, reverse_shift];
        (ratio + shift[0] + shift[1]).is_finite().then(|| Self {
            rotation,
            translation,
            log_focal: libm::log(focal),
            shift,
            ratio,
        })
    }

    /// By a step of the ten numbers; what follows them is not looked at.
    #[inline(never)]
    pub fn moved(&self, step: &[f64; NUMBERS]) -> Self {
        let [a, b, c, x, y, z, log_focal, s, ratio, reverse_s, ..] = *step;
        Self {
            rotation: turned(&self.rotation, [a, b, c]),
            translation: added(self.translation, [x, y, z], 1.0),
            log_focal: self.log_focal + log_focal,
            shift: [self.shift[0] + s, self.shift[1] + reverse_s],
            ratio: self.ratio + ratio,
        }
    }
}

/// The columns of diag(1, 1, f)·p are λ r₁, λ r₂, λ (f r₃ − s t) and λ t: rotation, t and s.
fn decomposed(p: &Projection, focal: f64) -> Option<(Rotation, Vector, f64)> {
    let column = |c: usize| [p[0][c], p[1][c], focal * p[2][c]];
    let scale = (dot(column(0), column(0)) * dot(column(1), column(1))).sqrt().sqrt();
    let column = |c: usize| column(c).map(|v| v / scale);
    let rotation = nearest_rotation(transposed(&[column(0), column(1), cross(column(0), column(1))]))?;
    let translation = column(3);
    let left = added(rotation.map(|row| focal * row[2]), column(2), -1.0);
    Some((rotation, translation, dot(left, translation) / dot(translation, translation)))
}

/// The orthogonal factor of the polar decomposition, by Newton's iteration A ← ½(A + A⁻ᵀ) (Higham 1986).
fn nearest_rotation(mut a: Rotation) -> Option<Rotation> {
    for _ in 0..20 {
        // The cofactors over the determinant are the inverse transposed.
        let cofactors = cofactors(&a);
        let determinant = dot(a[0], cofactors[0]);
        if determinant.is_nan() || determinant < 1e-9 {
            return None;
        }
        for (row, cofactors) in a.iter_mut().zip(cofactors) {
            *row = added(*row, cofactors, 1.0 / determinant).map(|v| 0.5 * v);
        }
    }
    Some(a)
}

#[inline(never)]
fn projection(rotation: &Rotation, t: Vector, focal: f64, shift: f64) -> Projection {
    std::array::from_fn(|i| {
        let [a, b, c] = rotation[i];
        // From ρ' to coordinates.
        let scale = if i < 2 { focal } else { 1.0 };
        [a, b, c * focal - t[i] * shift, t[i]].map(|v| v * scale)
    })
}

/// The rotation of the unit quaternion along (1, ω/2), which is exp([ω]×) up to the third order, times `rotation`.
fn turned(rotation: &Rotation, omega: Vector) -> Rotation {
    let [x, y, z] = omega.map(|v| 0.5 * v);
    let k = 2.0 / (1.0 + x * x + y * y + z * z);
    let by = [
        [1.0 - k * (y * y + z * z), k * (x * y - z), k * (x * z + y)],
        [k * (x * y + z), 1.0 - k * (x * x + z * z), k * (y * z - x)],
        [k * (x * z - y), k * (y * z + x), 1.0 - k * (x * x + y * y)],
    ];
    transposed(&transposed(rotation).map(|column| rotated(&by, column)))
}
