//! Normalised coordinates, in which the equations are well conditioned (Hartley 1997).

use nalgebra::{Matrix3, Matrix4};

use super::Model;
use super::correspondences::{Correspondence, Correspondences, ProjectionMatrix};
use crate::rect::diagonal;

/// Depth whose variance is less than this share of its squared mean is constant.
const CONSTANT: f64 = 1e-24;

/// The change of coordinates of both point sets and of the inverse depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normalisation {
    /// Scale, and shifts in x and y, of the source.
    source: [f64; 3],
    /// Scale and shift of the inverse depth.
    depth: [f64; 2],
    destination: [f64; 3],
}

impl Normalisation {
    /// Centres both point sets with mean distance √2 (Hartley), and gives the inverse depth mean 0 and variance 1, so that
    /// nothing depends on an affine change of depth. From matches in pixels; a constant depth becomes 0.
    pub fn hartley(points: &Correspondences) -> Self {
        let depth_mean = mean(points, |p| p.d);
        let variance = mean(points, |p| (p.d - depth_mean) * (p.d - depth_mean));
        // A constant depth is interpolated with errors of its last digits.
        let varies = variance.is_normal() && variance > CONSTANT * depth_mean * depth_mean;
        let scale = if varies { 1.0 / variance.sqrt() } else { 0.0 };
        Self {
            source: centring(points, |p| [p.x, p.y]),
            depth: [scale, -scale * depth_mean],
            destination: centring(points, |p| [p.u, p.v]),
        }
    }

    /// The same with one scale for both point sets, so that distances in both have the same weight. The depth is unchanged.
    pub fn isotropic(points: &Correspondences) -> Self {
        let ends = [centring(points, |p| [p.x, p.y]), centring(points, |p| [p.u, p.v])];
        let common = 2.0 / (1.0 / ends[0][0] + 1.0 / ends[1][0]);
        let [source, destination] = ends.map(|[s, x, y]| [common, common / s * x, common / s * y]);
        Self { source, depth: [1.0, 0.0], destination }
    }

    /// Coordinates from the centre of each photo, in its diagonals; the depth as in [`Normalisation::hartley`].
    pub fn from_centres(points: &Correspondences, source: (usize, usize), destination: (usize, usize)) -> Self {
        let centred = |size: (usize, usize)| {
            let s = 1.0 / diagonal(size);
            [s, -s * 0.5 * (size.0 as f64 - 1.0), -s * 0.5 * (size.1 as f64 - 1.0)]
        };
        Self { source: centred(source), destination: centred(destination), ..Self::hartley(points) }
    }

    /// An inverse depth, normalised.
    pub fn depth(&self, d: f64) -> f64 {
        self.depth[0] * d + self.depth[1]
    }

    /// The matches in normalised coordinates.
    pub fn apply(&self, points: &Correspondences) -> Correspondences {
        let ([s, sx, sy], [r, ru, rv]) = (self.source, self.destination);
        let normalised = |p: &Correspondence| Correspondence {
            x: s * p.x + sx,
            y: s * p.y + sy,
            d: self.depth(p.d),
            u: r * p.u + ru,
            v: r * p.v + rv,
        };
        points.iter().map(normalised).collect()
    }

    /// Normalised units per pixel of the destination.
    pub fn scale(&self) -> f64 {
        self.destination[0]
    }

    /// Normalised units per pixel of the source.
    pub fn source_scale(&self) -> f64 {
        self.source[0]
    }

    /// `model` in normalised coordinates.
    pub fn projection(&self, model: &Model) -> ProjectionMatrix {
        let [s, sx, sy] = self.source;
        let [k, kd] = self.depth;
        let pixels = source_matrix([1.0 / s, -sx / s, -sy / s], [1.0 / k, -kd / k]);
        let [r, ru, rv] = self.destination;
        let joined = ProjectionMatrix::from_columns(&[
            model.h.column(0),
            model.h.column(1),
            model.h.column(2),
            model.e.column(0),
        ]);
        Matrix3::new(r, 0.0, ru, 0.0, r, rv, 0.0, 0.0, 1.0) * joined * pixels
    }

    /// The model in pixels that belongs to `p` in normalised coordinates.
    pub fn model(&self, p: &ProjectionMatrix) -> Model {
        let [r, ru, rv] = self.destination;
        let pixels = Matrix3::new(1.0 / r, 0.0, -ru / r, 0.0, 1.0 / r, -rv / r, 0.0, 0.0, 1.0);
        let joined = pixels * p * source_matrix(self.source, self.depth);
        Model { h: joined.fixed_columns::<3>(0).into_owned(), e: joined.column(3).into_owned() }
    }
}

/// (x, y, 1, d) scaled and shifted.
fn source_matrix([s, sx, sy]: [f64; 3], [k, kd]: [f64; 2]) -> Matrix4<f64> {
    Matrix4::new(s, 0.0, sx, 0.0, 0.0, s, sy, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, kd, k)
}

fn mean(points: &[Correspondence], value: impl Fn(&Correspondence) -> f64) -> f64 {
    points.iter().map(value).sum::<f64>() / points.len().max(1) as f64
}

/// Scale and shifts that centre one end of the matches with mean distance √2.
fn centring(points: &[Correspondence], end: impl Fn(&Correspondence) -> [f64; 2]) -> [f64; 3] {
    let [cx, cy] = [0, 1].map(|k| mean(points, |p| end(p)[k]));
    let distance = mean(points, |p| {
        let [x, y] = end(p);
        ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt()
    });
    let s = if distance > 0.0 { std::f64::consts::SQRT_2 / distance } else { 1.0 };
    [s, -s * cx, -s * cy]
}
