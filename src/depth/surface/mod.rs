//! A smooth surface of inverse depth over a whole photo, from what is known of it here and there.
//!
//! H∞x + e·d is a homography wherever the inverse depth d is affine in x and y: a surface that bends little keeps straight lines
//! straight. And along the image of any straight line in space d is affine, whatever the depth is beside it.

mod background;
mod lines;
mod mesh;
mod samples;
mod solve;

use crate::features::LineSegment;
use crate::geometry::{DepthSample, Model, plane_depth};
use crate::image::reserve;
use crate::rect::diagonal;
use crate::statistics::median;
use crate::{Error, ImageView, InverseDepth, Result};
use background::background;
use lines::Line;
pub(crate) use lines::{PhotoLines, segments};
use mesh::{Mesh, Term};
use samples::Samples;
pub(crate) use solve::Solution;
use solve::System;

/// Reweightings, and after how many outliers lose more.
const PASSES: usize = 10;
const ROBUST: usize = 7;
/// Weight of a sample on a straight line where a map is corrected: less than elsewhere, as its edges are not where the photo's are. At a third,
/// half of the lines outside of nis-PTS_17 are broken; three times displaces what is outside of five degraded maps by a quarter more.
const CORRECTED_LINE: f64 = 2.4;

/// How inverse depth is extrapolated where only this photo shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Extrapolation {
    /// As it is at the border: nearest to the truth, but an error there grows with the distance.
    #[default]
    Surface,
    /// It soon becomes one plane of the scene, in which shapes stay as they are.
    Plane,
    /// Straight out from the border things stay as far away as they are there: nearest to the truth of all, but what stands on the ground leans
    /// where the ground goes on beneath it. As [`Extrapolation::Surface`] where the plane at infinity is not known.
    Outward,
    /// It soon becomes the plane parallel to the image that has this inverse depth relative to the plane at infinity.
    FrontoParallel(f64),
}

/// How a surface goes through what is known, and beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceShape {
    /// How much less it bends than by default, which is 1: a stiffer one gives up what is nearer or farther than the things
    /// around it rather than distort them.
    pub stiffness: f64,
    /// How depth is extrapolated outside of the other photo.
    pub extrapolation: Extrapolation,
    /// Whether it goes through what is known near the border of the overlap even where few samples say so: what only one photo shows continues what
    /// is there. Elsewhere such things are outliers, and the mosaic shows them from one photo.
    pub tight_at_border: bool,
}

impl SurfaceShape {
    /// # Errors
    /// `invalid-argument` for a stiffness that is no positive number, or a depth that is none.
    pub(super) fn check(&self) -> Result<()> {
        let Self { stiffness: value, .. } = *self;
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::InvalidArgument { name: "stiffness", expected: "a positive number", value }.into());
        }
        match self.extrapolation {
            Extrapolation::FrontoParallel(value) if !value.is_finite() => {
                Err(Error::InvalidArgument { name: "extrapolation", expected: "a finite inverse depth", value }.into())
            }
            _ => Ok(()),
        }
    }
}

impl Default for SurfaceShape {
    fn default() -> Self {
        Self { stiffness: 1.0, extrapolation: Extrapolation::Surface, tight_at_border: false }
    }
}

/// The other photo, outside of which nothing is known.
#[derive(Clone, Copy)]
pub(crate) struct OtherView<'a> {
    /// Leads there.
    pub model: &'a Model,
    /// Its width and height.
    pub size: (usize, usize),
    /// Slopes along x and y of the inverse depth of what is infinitely far, and so of everything at one distance, if they are known.
    pub infinity: Option<[f64; 2]>,
}

/// How far near the border of the overlap is, as a share of the other photo's diagonal: flat between 0.03 and 0.1.
const NEAR_BORDER: f64 = 0.05;

/// What lies closer to the other photo's border than this, in its pixels, was matched badly. Half and twice change PSNR by 0.1 %.
const MARGIN: f64 = 3.0;

impl<'a> OtherView<'a> {
    /// Of whose plane at infinity nothing is known.
    pub(crate) fn new(model: &'a Model, size: (usize, usize)) -> Self {
        Self { model, size, infinity: None }
    }

    /// Whether a point with this depth lands inside of the other photo, and not next to its border.
    pub(crate) fn contains(&self, [x, y]: [f64; 2], depth: f64) -> bool {
        let limit = [self.size.0, self.size.1].map(|side| side as f64 - MARGIN);
        let place = self.model.project(x, y, depth).unwrap_or_default();
        place.iter().zip(limit).all(|(p, limit)| *p >= MARGIN && *p < limit)
    }

    /// How far in pixels inside of the other photo's border a point with this depth lands; negative outside, and behind its
    /// camera.
    pub(super) fn inset(&self, [x, y]: [f64; 2], depth: f64) -> f64 {
        self.model.project(x, y, depth).map_or(f64::NEG_INFINITY, |place| inset(place, self.size))
    }

    /// How near the border of the overlap a sample of a photo of this size is, whichever photo's border that is: from 0, far away, to 1.
    pub(crate) fn nearness(&self, sample: &DepthSample, size: (usize, usize)) -> f64 {
        let distance = inset(sample.point, size).min(self.inset(sample.point, sample.depth)).max(0.0);
        libm::exp(-distance / (NEAR_BORDER * diagonal(self.size)))
    }

    /// How far in pixels outside of the other photo a point with this depth lands, 0 inside; infinitely far behind its camera.
    pub(crate) fn distance(&self, [x, y]: [f64; 2], depth: f64) -> f64 {
        self.model.project(x, y, depth).map_or(f64::INFINITY, |place| outside(place, self.size))
    }
}

/// How far in pixels a place is inside of the border of a photo of this size; negative outside.
fn inset([u, v]: [f64; 2], (w, h): (usize, usize)) -> f64 {
    let within = |p: f64, side: usize| p.min((side - 1) as f64 - p);
    within(u, w).min(within(v, h))
}

/// How far in pixels a place is outside of a photo of this size, 0 inside.
fn outside([u, v]: [f64; 2], (w, h): (usize, usize)) -> f64 {
    let beyond = |p: f64, side: usize| (-p).max(p - (side - 1) as f64).max(0.0);
    let (a, b) = (beyond(u, w), beyond(v, h));
    (a * a + b * b).sqrt()
}

/// The equations of a surface, but for how stiff it is and how it is extrapolated. What they solve for are deviations from a plane,
/// in pixels of parallax.
pub(super) struct Equations {
    mesh: Mesh,
    plane: [f64; 3],
    /// Pixels per unit of inverse depth that most samples move by.
    parallax: f64,
    samples: Samples,
    smoothness: Vec<Term>,
    lines: Vec<Line>,
    solution: Solution,
    /// The values after the first pass for a stiffness, tight at the border or not, which most extrapolations have in common.
    first: Option<((f64, bool), Vec<f64>)>,
}

/// Values at the vertices of a regular mesh, bilinear between them.
pub(crate) struct Surface {
    mesh: Mesh,
    values: Vec<f64>,
}

/// Weight of a residual, in units of what is usual: 1/√(1 + r²), or that to the power 3/2.
fn robust(residual: f64, late: bool) -> f64 {
    let weight = 1.0 / (1.0 + residual * residual).sqrt();
    if late { weight * weight.sqrt() } else { weight }
}

impl Equations {
    /// For `samples` of a photo of this size, [`sample_step`] apart, and its `matches`, each of which counts as a whole cell of the
    /// mesh: the surface bends where the photo has edges rather than elsewhere, is affine along the `segments`, and far from all
    /// samples the background's plane, as far as the `solution` goes.
    ///
    /// `None` when they do not determine a plane.
    pub fn new(
        samples: &[DepthSample],
        matches: &[DepthSample],
        size: (usize, usize),
        photo: Option<ImageView<'_>>,
        (segments, solution): (&[LineSegment], Solution),
        other: &OtherView<'_>,
    ) -> Result<Option<Self>> {
        let all = [samples, matches].concat();
        let Some(plane) = background(&all, size, other) else { return Ok(None) };
        let nearness = |sample: &DepthSample| other.nearness(sample, size);
        let Some(mut found) = Self::of_samples(samples, matches, size, plane, &nearness)? else { return Ok(None) };
        found.solution = solution;
        found.smoothness = found.mesh.smoothness(photo);
        let upright = other.infinity.map(|slopes| found.deviations(slopes));
        found.lines = lines::along(&found.mesh, segments, size, lines::LINE, &|_| 0.0, upright);
        Ok(Some(found))
    }

    /// Of a surface to be added to the inverse depth `prior`, for `samples` and `matches` of what it is wrong by: the sum is affine
    /// along the `segments`; colours play no part. `None` when there is no parallax.
    pub fn of_correction(
        samples: &[DepthSample],
        matches: &[DepthSample],
        prior: &InverseDepth,
        segments: &[LineSegment],
    ) -> Result<Option<Self>> {
        let Some(mut found) = Self::of_samples(samples, matches, prior.size(), [0.0; 3], &|_| 0.0)? else {
            return Ok(None);
        };
        found.smoothness = found.mesh.smoothness(None);
        let prior_of = |[x, y]: [f64; 2]| -prior.sample(x, y) * found.parallax;
        found.lines = lines::along(&found.mesh, segments, prior.size(), CORRECTED_LINE, &prior_of, None);
        Ok(Some(found))
    }

    fn of_samples(
        samples: &[DepthSample],
        matches: &[DepthSample],
        size: (usize, usize),
        plane: [f64; 3],
        nearness: &dyn Fn(&DepthSample) -> f64,
    ) -> Result<Option<Self>> {
        let mesh = Mesh::over(size);
        let Some(parallax) = median(samples.iter().chain(matches).map(|s| s.parallax).collect()) else {
            return Ok(None);
        };
        if !parallax.is_normal() {
            return Ok(None);
        }
        let samples = Samples::new(&mesh, [samples, matches], plane, parallax, nearness)?;
        let (smoothness, lines, solution) = (Vec::new(), Vec::new(), Solution::Damped);
        Ok(Some(Self { mesh, plane, parallax, samples, smoothness, lines, solution, first: None }))
    }

    /// Slopes of inverse depth along x and y, as those of the values.
    fn deviations(&self, slopes: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (slopes[k] - self.plane[k]) * self.parallax)
    }

    /// The surface, by reweighted least squares; `None` where they do not determine it.
    pub fn solve(&mut self, other: &OtherView<'_>, shape: SurfaceShape) -> Result<Option<Surface>> {
        let slopes = other.infinity.map(|slopes| self.deviations(slopes));
        let Self { mesh, plane, parallax, samples, smoothness, lines, solution, first } = self;
        let SurfaceShape { stiffness, extrapolation, tight_at_border: tight } = shape;
        // What the values become far outside, relative to the background's plane.
        let goal = match (extrapolation, slopes) {
            (Extrapolation::Plane, _) => Some([0.0; 3]),
            (Extrapolation::FrontoParallel(depth), Some([a, b])) => Some([a, b, (depth - plane[2]) * *parallax]),
            _ => None,
        };
        let mut fixed = System::new(mesh)?;
        fixed.add(smoothness, stiffness);
        let mut pulls = Vec::new();
        let outward = slopes.filter(|_| extrapolation == Extrapolation::Outward);
        if let Some(slopes) = outward {
            reserve(&mut pulls, 2 * mesh.len())?;
            mesh.pull_slopes(&|point| plane_depth(*plane, point), other, slopes, &mut pulls);
            fixed.add(&pulls, stiffness);
        }
        let (mut from, mut values) = (0, vec![0.0; mesh.len()]);
        if let Some((_, known)) = first.as_ref().filter(|(known, _)| *known == (stiffness, tight) && outward.is_none())
        {
            lines.iter_mut().for_each(|line| line.reweight(&values, 0));
            (from, values) = (1, known.clone());
        }
        for pass in from..PASSES {
            pulls.clear();
            // At first nothing is known of where the vertices land.
            let far = goal.filter(|_| pass > 0).map(|goal| (other, goal));
            let depth = |node: usize, point: [f64; 2]| values[node] / *parallax + plane_depth(*plane, point);
            mesh.pull(&depth, far, &mut pulls);
            let mut system = fixed.clone();
            system.add(&pulls, stiffness);
            let Some(next) = solve::reweighted(system, (samples, tight), lines, &values, pass, *solution)? else {
                return Ok(None);
            };
            values = next;
            if pass == 0 && outward.is_none() {
                *first = Some(((stiffness, tight), values.clone()));
            }
        }
        for (node, point) in mesh.vertices() {
            values[node] = values[node] / *parallax + plane_depth(*plane, point);
        }
        Ok(Some(Surface { mesh: *mesh, values }))
    }
}

impl Surface {
    /// Inverse depth at a point of the photo.
    pub fn at(&self, point: [f64; 2]) -> f64 {
        let (nodes, weights) = self.mesh.cell(point);
        nodes.iter().zip(weights).map(|(&node, weight)| weight * self.values[node]).sum()
    }

    /// A map of the photo's size.
    pub fn map(&self, (w, h): (usize, usize)) -> Result<InverseDepth> {
        Ok(InverseDepth::from_values(self.dense((w, h))?, w, h))
    }

    /// The same, row by row.
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
pub(crate) fn sample_step(size: (usize, usize)) -> usize {
    Mesh::over(size).sample_step()
}

/// What a sample of a photo of this size weighs, next to a match.
pub(crate) fn sample_weight(size: (usize, usize)) -> f64 {
    Mesh::over(size).sample_weight()
}

/// The pixels of a photo of this size that are samples, row by row: x and y.
pub(crate) fn sample_grid((w, h): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    let step = sample_step((w, h));
    (0..h).step_by(step).flat_map(move |y| (0..w).step_by(step).map(move |x| (x, y)))
}
