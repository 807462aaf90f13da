//! A smooth surface of inverse depth over a whole photo, from what is known of it here and there.
//!
//! H∞x + e·d is a homography wherever the inverse depth d is affine in x and y: a surface that bends little keeps straight lines
//! straight. And along the image of any straight line in space d is affine, whatever the depth is beside it.

mod background;
mod lines;
mod mesh;
mod solve;

use crate::features::LineSegment;
use crate::geometry::{DepthSample, Model, plane_depth};
use crate::image::reserve;
use crate::statistics::median;
use crate::{ImageView, Result};
use background::background;
use mesh::Mesh;

/// Reweightings, and after how many outliers lose more.
const PASSES: usize = 10;
const ROBUST: usize = 7;

/// How inverse depth goes on where only this photo shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extrapolation {
    /// As it is at the border: nearest to the truth, but an error there grows with the distance.
    #[default]
    Surface,
    /// It soon becomes one plane of the scene, in which shapes stay as they are.
    Plane,
}

/// The other photo, outside of which nothing is known.
#[derive(Clone, Copy)]
pub(crate) struct Outside<'a> {
    /// Leads there.
    pub model: &'a Model,
    /// Its width and height.
    pub size: (usize, usize),
}

/// Values at the vertices of a regular mesh, bilinear between them.
pub(super) struct Surface {
    mesh: Mesh,
    values: Vec<f64>,
}

/// Weight of a residual, in units of what is usual: 1/√(1 + r²), or that to the power 3/2.
fn robust(residual: f64, late: bool) -> f64 {
    let weight = 1.0 / (1.0 + residual * residual).sqrt();
    if late { weight * weight.sqrt() } else { weight }
}

impl Surface {
    /// Fits a surface to `samples` of a photo of this size, by reweighted least squares: it bends where the photo has edges
    /// rather than elsewhere, is affine along the `segments`, and far from all samples the background's plane.
    ///
    /// `None` when the samples do not determine a plane.
    pub fn fit(
        samples: &[DepthSample],
        size: (usize, usize),
        photo: Option<ImageView<'_>>,
        segments: &[LineSegment],
        other: &Outside<'_>,
        extrapolation: Extrapolation,
    ) -> Result<Option<Self>> {
        let mesh = Mesh::over(size);
        let Some(plane) = background(samples, size, other) else { return Ok(None) };
        let Some(parallax) = median(samples.iter().map(|s| s.parallax).collect()) else { return Ok(None) };
        if !parallax.is_normal() {
            return Ok(None);
        }
        // Deviations from the plane, in pixels of parallax.
        let mut terms = Vec::new();
        reserve(&mut terms, samples.len() + 8 * mesh.len())?;
        mesh.data(samples, plane, parallax, &mut terms);
        mesh.smoothness(photo, &mut terms);
        let mut lines = lines::along(&mesh, segments, size);
        let mut values = vec![0.0; mesh.len()];
        let pulls = terms.len();
        for pass in 0..PASSES {
            terms.truncate(pulls);
            // At first nothing is known of where the vertices land.
            let other = Some(other).filter(|_| pass > 0 && extrapolation == Extrapolation::Plane);
            let depth = |node: usize, point: [f64; 2]| values[node] / parallax + plane_depth(plane, point);
            mesh.pull(&depth, other, &mut terms);
            let Some(next) = solve::reweighted(&mesh, &terms, &mut lines, &values, pass)? else { return Ok(None) };
            values = next;
        }
        for (node, point) in mesh.vertices() {
            values[node] = values[node] / parallax + plane_depth(plane, point);
        }
        Ok(Some(Self { mesh, values }))
    }

    /// A map of the photo's size, row by row.
    pub fn dense(&self, (w, h): (usize, usize)) -> Result<Vec<f32>> {
        let mut out = Vec::new();
        reserve(&mut out, w * h)?;
        let mesh = &self.mesh;
        for y in 0..h {
            let mut ends = [0.0; 2];
            let mut cell = usize::MAX;
            for x in 0..w {
                let p = x as f64 / mesh.spacing;
                let i = (p as usize).min(mesh.columns - 2);
                if i != cell {
                    cell = i;
                    let q = (y as f64 / mesh.spacing).min((mesh.rows - 1) as f64);
                    let j = (q as usize).min(mesh.rows - 2);
                    ends = [i, i + 1].map(|i| {
                        let [a, b] = [j, j + 1].map(|j| self.values[mesh.node(i, j)]);
                        a + (b - a) * (q - j as f64)
                    });
                }
                out.push((ends[0] + (ends[1] - ends[0]) * (p - i as f64)) as f32);
            }
        }
        Ok(out)
    }
}

/// Pixels from one sample to the next, for a photo of this size.
pub(super) fn sample_step(size: (usize, usize)) -> usize {
    Mesh::over(size).sample_step()
}
