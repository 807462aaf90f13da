//! Matches of one direction, and their normalised coordinates.

use std::ops::Deref;

use super::Model;
use super::clean::flagged;
use nalgebra::{Matrix3, Vector3};

/// A 3×4 matrix [H | e] that maps (x, y, 1, d) to the other photo: a camera, when (x, y, 1, d) is read as a
/// homogeneous point of space. Its last column is zero for a homography.
pub(super) type Projection = [[f64; 4]; 3];

/// A match of one direction: source point, its inverse depth, destination point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub x: f64,
    pub y: f64,
    pub d: f64,
    pub u: f64,
    pub v: f64,
}

impl Point {
    /// Third coordinate of the image, positive in front of the camera.
    #[inline(never)]
    pub fn third(&self, p: &Projection) -> f64 {
        transform(p, self.x, self.y, self.d)[2]
    }
}

/// Matches of one direction.
#[derive(Debug, Clone, Default)]
pub(super) struct Points(Vec<Point>);

impl Deref for Points {
    type Target = [Point];

    fn deref(&self) -> &[Point] {
        &self.0
    }
}

impl Points {
    #[inline(never)]
    pub fn push(&mut self, [x, y]: [f64; 2], d: f64, [u, v]: [f64; 2]) {
        self.0.push(Point { x, y, d, u, v });
    }

    /// The matches whose flag is set.
    #[inline(never)]
    pub fn select(&self, flags: &[bool]) -> Points {
        Self(flagged(self, flags))
    }

    /// At most `most` of the matches, evenly.
    pub fn thinned(&self, most: usize) -> Points {
        let step = self.len().div_ceil(most).max(1);
        self.select(&(0..self.len()).map(|i| i.is_multiple_of(step)).collect::<Vec<_>>())
    }
}

/// Homogeneous image of (x, y, 1, d).
#[inline(always)]
pub(super) fn transform(p: &Projection, x: f64, y: f64, d: f64) -> [f64; 3] {
    let along = |row: &[f64; 4]| row[0] * x + row[1] * y + row[2] + row[3] * d;
    // Not `map`, which becomes a call.
    [along(&p[0]), along(&p[1]), along(&p[2])]
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
    #[inline(never)]
    pub fn of(points: &Points) -> Self {
        let depth_mean = mean(points, &|p| p.d);
        let variance = mean(points, &|p| (p.d - depth_mean) * (p.d - depth_mean));
        let scale = if variance.is_normal() { 1.0 / variance.sqrt() } else { 0.0 };
        Self {
            source: hartley(points, &|p| [p.x, p.y]),
            depth: [scale, -scale * depth_mean],
            destination: hartley(points, &|p| [p.u, p.v]),
        }
    }

    /// From matches in pixels, with the same scale for both point sets, so that distances in the one and in the other weigh
    /// the same. The depth stays as it is.
    pub fn isotropic(points: &Points) -> Self {
        let ends = [hartley(points, &|p| [p.x, p.y]), hartley(points, &|p| [p.u, p.v])];
        let common = 2.0 / (1.0 / ends[0][0] + 1.0 / ends[1][0]);
        let [source, destination] = ends.map(|[s, x, y]| [common, common / s * x, common / s * y]);
        Self { source, depth: [1.0, 0.0], destination }
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
    #[inline(never)]
    pub fn apply(&self, points: &Points) -> Points {
        let ([s, sx, sy], [k, kd], [r, ru, rv]) = (self.source, self.depth, self.destination);
        let normalised =
            |p: &Point| Point { x: s * p.x + sx, y: s * p.y + sy, d: k * p.d + kd, u: r * p.u + ru, v: r * p.v + rv };
        Points(points.iter().map(normalised).collect())
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

#[inline(never)]
fn mean(points: &[Point], value: &dyn Fn(&Point) -> f64) -> f64 {
    points.iter().map(value).sum::<f64>() / points.len().max(1) as f64
}

/// Scale and shifts that centre one end of the matches with mean distance √2.
#[inline(never)]
fn hartley(points: &[Point], end: &dyn Fn(&Point) -> [f64; 2]) -> [f64; 3] {
    let [cx, cy] = [0, 1].map(|k| mean(points, &|p| end(p)[k]));
    let distance = mean(points, &|p| {
        let [x, y] = end(p);
        ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt()
    });
    let s = if distance > 0.0 { std::f64::consts::SQRT_2 / distance } else { 1.0 };
    [s, -s * cx, -s * cy]
}
