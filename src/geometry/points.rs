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

    #[inline(never)]
    pub fn push(&mut self, source: [f64; 2], depth: f64, destination: [f64; 2]) {
        self.x.push(source[0]);
        self.y.push(source[1]);
        self.d.push(depth);
        self.u.push(destination[0]);
        self.v.push(destination[1]);
    }

    /// The matches whose flag is set.
    pub fn select(&self, flags: &[bool]) -> Points {
        self.picked((0..self.len()).filter(|&i| flags[i]))
    }

    /// At most `most` of the matches, evenly.
    pub fn thinned(&self, most: usize) -> Points {
        self.picked((0..self.len()).step_by(self.len().div_ceil(most).max(1)))
    }

    fn picked(&self, indices: impl Iterator<Item = usize>) -> Points {
        let mut picked = Points::default();
        indices.for_each(|i| picked.push([self.x[i], self.y[i]], self.d[i], [self.u[i], self.v[i]]));
        picked
    }

    /// Third coordinate of the image of match `i`, positive in front of the camera.
    pub fn third(&self, p: &Projection, i: usize) -> f64 {
        transform(p, self.x[i], self.y[i], self.d[i])[2]
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

/// The thresholds at which a model is judged, in normalised coordinates, widest first.
///
/// The cost of a match is Σ_k min(r²/t_k², 1): MSAC (Torr & Zisserman 2000) summed over the scales, so that neither a
/// chance consensus at the narrowest nor a sloppy one at the widest wins. With all three equal it is MSAC.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales(pub [f64; 3]);

impl Scales {
    pub fn widest(&self) -> f64 {
        self.0[0]
    }

    pub fn narrowest(&self) -> f64 {
        self.0[2]
    }

    /// Cost of a model; a point behind the camera costs the most. Stops once it reaches `limit`.
    pub fn cost(&self, points: &Points, p: &Projection, limit: f64) -> f64 {
        const BLOCK: usize = 64;
        const LANES: usize = 4;
        let inverse = self.0.map(|t| 1.0 / (t * t));
        let n = points.len();
        let mut cost = 0.0;
        let mut start = 0;
        while start < n && cost < limit {
            let end = (start + BLOCK).min(n);
            let (x, y, d) = (&points.x[start..end], &points.y[start..end], &points.d[start..end]);
            let (u, v) = (&points.u[start..end], &points.v[start..end]);
            // What is left of the last block costs nothing.
            let mut errors = [0.0; BLOCK];
            for i in 0..end - start {
                let [a, b, w] = transform(p, x[i], y[i], d[i]);
                let reciprocal = 1.0 / w;
                let (du, dv) = (a * reciprocal - u[i], b * reciprocal - v[i]);
                errors[i] = if w > 0.0 { du * du + dv * dv } else { f64::INFINITY };
            }
            // Lanes of their own, so that the additions need not wait for each other.
            let mut sums = [0.0; LANES];
            for chunk in errors.chunks_exact(LANES) {
                for (sum, r2) in sums.iter_mut().zip(chunk) {
                    for scale in inverse {
                        let share = r2 * scale;
                        *sum += if share < 1.0 { share } else { 1.0 };
                    }
                }
            }
            cost += sums.iter().sum::<f64>();
            start = end;
        }
        cost
    }
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

    /// From the centre of each photo, in its diagonals; the depth as in [`Normalisation::of`].
    pub fn from_centres(points: &Points, source: (usize, usize), destination: (usize, usize)) -> Self {
        let centred = |(w, h): (usize, usize)| {
            let (w, h) = (w as f64, h as f64);
            let s = 1.0 / (w * w + h * h).sqrt();
            [s, -s * 0.5 * (w - 1.0), -s * 0.5 * (h - 1.0)]
        };
        Self { source: centred(source), destination: centred(destination), ..Self::of(points) }
    }

    /// A depth, normalised.
    pub fn depth(&self, d: f64) -> f64 {
        self.depth[0] * d + self.depth[1]
    }

    /// `model` in normalised coordinates.
    pub fn projection(&self, model: &Model) -> Projection {
        let ([s, sx, sy], [k, kd], [r, ru, rv]) = (self.source, self.depth, self.destination);
        let row = |i: usize| {
            let [a, b, c, e] = [model.h[(i, 0)] / s, model.h[(i, 1)] / s, model.h[(i, 2)], model.e[i] / k];
            [a, b, c - a * sx - b * sy - e * kd, e]
        };
        let w = row(2);
        let lower = |a: [f64; 4], shift: f64| [0, 1, 2, 3].map(|j| r * a[j] + shift * w[j]);
        [lower(row(0), ru), lower(row(1), rv), w]
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

    /// Normalised units per pixel of the source.
    pub fn source_scale(&self) -> f64 {
        self.source[0]
    }

    /// The model in pixels that belongs to `p` in normalised coordinates.
    pub fn model(&self, p: &Projection) -> Model {
        let ([s, sx, sy], [k, kd], [r, ru, rv]) = (self.source, self.depth, self.destination);
        let row = |i: usize| {
            let [a, b, c, e] = p[i];
            [a * s, b * s, a * sx + b * sy + c + e * kd, e * k]
        };
        let (a, b, w) = (row(0), row(1), row(2));
        let lift = |a: [f64; 4], shift: f64| [0, 1, 2, 3].map(|j| (a[j] - shift * w[j]) / r);
        let (a, b) = (lift(a, ru), lift(b, rv));
        Model {
            h: Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], w[0], w[1], w[2]),
            e: Vector3::new(a[3], b[3], w[3]),
        }
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
