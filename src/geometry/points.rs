//! Matches in normalised coordinates, laid out so that the scoring loops vectorise.

use super::Model;
use nalgebra::{Matrix3, Vector3};

/// A 3×4 matrix [H | e] that maps (x, y, 1, d) to the other photo: a camera, when (x, y, 1, d) is read as a
/// homogeneous point of space. Its last column is zero for a homography.
pub(super) type Projection = [[f64; 4]; 3];

/// Matches of one direction: source point, its inverse depth, destination point.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub d: Vec<f64>,
    pub u: Vec<f64>,
    pub v: Vec<f64>,
}

impl Points {
    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn push(&mut self, source: [f64; 2], depth: f64, destination: [f64; 2]) {
        self.x.push(source[0]);
        self.y.push(source[1]);
        self.d.push(depth);
        self.u.push(destination[0]);
        self.v.push(destination[1]);
    }

    /// The matches whose flag is set.
    pub fn select(&self, flags: &[bool]) -> Points {
        let pick = |a: &[f64]| a.iter().zip(flags).filter(|(_, f)| **f).map(|(v, _)| *v).collect();
        Points { x: pick(&self.x), y: pick(&self.y), d: pick(&self.d), u: pick(&self.u), v: pick(&self.v) }
    }

    /// Squared transfer errors in front of the camera, infinite behind it.
    pub fn errors<'a>(&'a self, p: &'a Projection) -> impl Iterator<Item = f64> + 'a {
        (0..self.len()).map(move |i| {
            squared_error(p, self.x[i], self.y[i], self.d[i], self.u[i], self.v[i]).unwrap_or(f64::INFINITY)
        })
    }
}

/// Homogeneous image of (x, y, 1, d).
#[inline(always)]
pub(super) fn transform(p: &Projection, x: f64, y: f64, d: f64) -> [f64; 3] {
    [0, 1, 2].map(|r| p[r][0] * x + p[r][1] * y + p[r][2] + p[r][3] * d)
}

#[inline(always)]
fn squared_error(p: &Projection, x: f64, y: f64, d: f64, u: f64, v: f64) -> Option<f64> {
    let [a, b, w] = transform(p, x, y, d);
    let (du, dv) = (a / w - u, b / w - v);
    (w > 0.0).then_some(du * du + dv * dv)
}

/// MSAC cost Σ min(r², t²) with a point behind the camera counted as t². Stops once the cost reaches `limit`.
pub(super) fn msac_cost(points: &Points, p: &Projection, t2: f64, limit: f64) -> f64 {
    const BLOCK: usize = 64;
    let n = points.len();
    let mut cost = 0.0;
    let mut start = 0;
    while start < n && cost < limit {
        let end = (start + BLOCK).min(n);
        let (x, y, d) = (&points.x[start..end], &points.y[start..end], &points.d[start..end]);
        let (u, v) = (&points.u[start..end], &points.v[start..end]);
        // Two partial sums: the order of additions is fixed, and wide enough for two lanes.
        let mut sums = [0.0; 2];
        for i in 0..end - start {
            let [a, b, w] = transform(p, x[i], y[i], d[i]);
            let inverse = 1.0 / w;
            let (du, dv) = (a * inverse - u[i], b * inverse - v[i]);
            let r2 = du * du + dv * dv;
            sums[i & 1] += if w > 0.0 && r2 < t2 { r2 } else { t2 };
        }
        cost += sums[0] + sums[1];
        start = end;
    }
    cost
}

/// The change of coordinates that centres both point sets with mean distance √2 (Hartley) and gives the inverse depth
/// mean 0 and variance 1, so that nothing depends on an affine change of depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normalisation {
    source: [f64; 3],
    depth: [f64; 2],
    destination: [f64; 3],
}

impl Normalisation {
    /// From matches in pixels. A constant depth keeps its scale.
    pub fn of(points: &Points) -> Self {
        let depth_mean = mean(points.d.iter().copied());
        let variance = mean(points.d.iter().map(|d| (d - depth_mean) * (d - depth_mean)));
        let scale = if variance.is_normal() { 1.0 / variance.sqrt() } else { 0.0 };
        Self {
            source: hartley(&points.x, &points.y),
            depth: [scale, -scale * depth_mean],
            destination: hartley(&points.u, &points.v),
        }
    }

    /// The matches in normalised coordinates.
    pub fn apply(&self, points: &Points) -> Points {
        let affine = |a: &[f64], scale: f64, shift: f64| a.iter().map(|v| scale * v + shift).collect();
        let ([s, sx, sy], [k, kd], [r, ru, rv]) = (self.source, self.depth, self.destination);
        Points {
            x: affine(&points.x, s, sx),
            y: affine(&points.y, s, sy),
            d: affine(&points.d, k, kd),
            u: affine(&points.u, r, ru),
            v: affine(&points.v, r, rv),
        }
    }

    /// Normalised units per pixel of the destination.
    pub fn scale(&self) -> f64 {
        self.destination[0]
    }

    /// The model in pixels that belongs to `p` in normalised coordinates, scaled to unit Frobenius norm of H.
    pub fn model(&self, p: &Projection) -> Model {
        let ([s, sx, sy], [k, kd], [r, ru, rv]) = (self.source, self.depth, self.destination);
        let row = |i: usize| {
            let [a, b, c, e] = p[i];
            [a * s, b * s, a * sx + b * sy + c + e * kd, e * k]
        };
        let (a, b, w) = (row(0), row(1), row(2));
        let lift = |a: [f64; 4], shift: f64| [0, 1, 2, 3].map(|j| (a[j] - shift * w[j]) / r);
        let (a, b) = (lift(a, ru), lift(b, rv));
        let h = Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], w[0], w[1], w[2]);
        let scale = 1.0 / h.norm();
        Model { h: h * scale, e: Vector3::new(a[3], b[3], w[3]) * scale }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    sum / n.max(1) as f64
}

/// Scale and shifts that centre the points with mean distance √2.
fn hartley(x: &[f64], y: &[f64]) -> [f64; 3] {
    let (cx, cy) = (mean(x.iter().copied()), mean(y.iter().copied()));
    let distance = mean(x.iter().zip(y).map(|(x, y)| ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt()));
    let s = if distance > 0.0 { std::f64::consts::SQRT_2 / distance } else { 1.0 };
    [s, -s * cx, -s * cy]
}
