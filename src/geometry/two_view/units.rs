//! Normalised coordinates for epipolar geometry.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::Model;
use crate::geometry::points::{Points, Projection};

/// The change of coordinates that centres both point sets with mean distance √2, with the same scale for both, so that
/// distances in the one and in the other weigh the same.
pub(super) struct Units {
    target: [f64; 2],
    reference: [f64; 2],
    /// Normalised units per pixel.
    pub scale: f64,
}

impl Units {
    /// From matches in pixels.
    pub fn of(points: &Points) -> Self {
        let n = points.len() as f64;
        let mean = |a: &[f64]| a.iter().sum::<f64>() / n;
        let [x, y, u, v] = [&points.x, &points.y, &points.u, &points.v].map(|a| mean(a));
        let distances = |a: &[f64], b: &[f64], x: f64, y: f64| -> f64 {
            a.iter().zip(b).map(|(a, b)| ((a - x) * (a - x) + (b - y) * (b - y)).sqrt()).sum()
        };
        let sum = distances(&points.x, &points.y, x, y) + distances(&points.u, &points.v, u, v);
        let scale = if sum > 0.0 { std::f64::consts::SQRT_2 * 2.0 * n / sum } else { 1.0 };
        Self { target: [x, y], reference: [u, v], scale }
    }

    /// The matches in normalised coordinates.
    pub fn apply(&self, points: &Points) -> Points {
        let affine = |a: &[f64], centre: f64| a.iter().map(|v| self.scale * (v - centre)).collect();
        Points {
            x: affine(&points.x, self.target[0]),
            y: affine(&points.y, self.target[1]),
            d: points.d.clone(),
            u: affine(&points.u, self.reference[0]),
            v: affine(&points.v, self.reference[1]),
        }
    }

    /// The model in pixels that belongs to `p` in normalised coordinates.
    pub fn model(&self, p: &Projection) -> Model {
        let (to, [_, from]) = (self.matrices(self.target)[0], self.matrices(self.reference));
        let h = Matrix3::from_fn(|r, c| p[r][c]);
        Model { h: from * h * to, e: from * Vector3::from_fn(|r, _| p[r][3]) }
    }

    /// A model in pixels as a projection in normalised coordinates.
    pub fn projection(&self, model: &Model) -> Projection {
        let (to, from) = (self.matrices(self.reference)[0], self.matrices(self.target)[1]);
        let (h, e) = (to * model.h * from, to * model.e);
        [0, 1, 2].map(|r| [h[(r, 0)], h[(r, 1)], h[(r, 2)], e[r]])
    }

    /// To normalised coordinates and back.
    fn matrices(&self, [x, y]: [f64; 2]) -> [Matrix3<f64>; 2] {
        let (s, t) = (self.scale, 1.0 / self.scale);
        [Matrix3::new(s, 0.0, -s * x, 0.0, s, -s * y, 0.0, 0.0, 1.0), Matrix3::new(t, 0.0, x, 0.0, t, y, 0.0, 0.0, 1.0)]
    }
}
