//! Straight lines of the photo, along which inverse depth is affine; upright ones are at one distance.

use super::mesh::{Mesh, Term};
use super::{ROBUST, robust};
use crate::features::{LineSegment, LineSegmentOptions, join_collinear, line_segments};
use crate::line_fit::LineFit;
use crate::rect::diagonal;
use crate::{ImageView, Result};

// Tuned on the evaluation cases. Means of 13 pairs of real photos, two photos alone, at half and twice each:

/// Weight of a sample on a straight line: PSNR changes by 0.4 %, bending outside by 2 %.
pub(super) const LINE: f64 = 8.0;
/// Segments shorter than this share of the diagonal are left out: at half, PSNR falls by 0.4 % and what only the target shows bends
/// 14 % less; twice changes them by 0.3 % and 4 %.
const SHORTEST: f64 = 0.04;
/// What continues a segment is at least this long, and no farther beside it and away than this, as shares of the diagonal: a lamp post is a line to its
/// foot, whatever is behind it.
const PART: f64 = 0.012;
const TOLERANCE: f64 = 0.0007;
const GAP: f64 = 0.01;
/// An occluding edge belongs to the nearer of its sides, in pixels from the line: both change by less than 0.1 %.
const BESIDE: f64 = 2.5;
/// Most tangent of the angle between the photo's y axis and an upright line.
const TILT: f64 = 0.25;
/// Pixels of parallax from which on an upright line counts less: what stands upright does so against what the ground says around it. A quarter displaces what
/// is hidden of 13 pairs of real photos by 2 % more.
const UPRIGHT: f64 = 20.0;

/// Terms along a straight line, whose values, less their targets, are affine in `along`.
pub(super) struct Line {
    pub terms: Vec<Term>,
    along: Vec<f64>,
    pub weights: Vec<f64>,
    weight: f64,
    /// Whether the values are to be constant instead.
    constant: bool,
}

/// The straight lines of a photo that are long enough to take part: each from end to end with `join`, or its longest parts.
pub(crate) fn segments(photo: ImageView<'_>, join: bool) -> Result<Vec<LineSegment>> {
    if join { Ok(joined(longer_than(PART, photo)?, photo.size())) } else { longer_than(SHORTEST, photo) }
}

/// Both the longest parts of the straight lines of a photo and the lines from end to end.
pub(crate) struct PhotoLines {
    pub parts: Vec<LineSegment>,
    pub joined: Vec<LineSegment>,
}

impl PhotoLines {
    pub fn of(photo: ImageView<'_>) -> Result<Self> {
        let (segments, size) = (longer_than(PART, photo)?, photo.size());
        let long = |segment: &&LineSegment| segment.length() >= SHORTEST * diagonal(size);
        Ok(Self { parts: segments.iter().filter(long).copied().collect(), joined: joined(segments, size) })
    }
}

/// The segments of a photo that are longer than a share of its diagonal.
fn longer_than(share: f64, photo: ImageView<'_>) -> Result<Vec<LineSegment>> {
    let min_length = share * diagonal(photo.size());
    line_segments(photo, &LineSegmentOptions { min_length, ..LineSegmentOptions::default() })
}

/// Lines of a photo of this size from end to end, but for those that are short.
fn joined(segments: Vec<LineSegment>, size: (usize, usize)) -> Vec<LineSegment> {
    let [shortest, tolerance, gap] = [SHORTEST, TOLERANCE, GAP].map(|share| share * diagonal(size));
    join_collinear(segments, shortest, tolerance, gap)
}

/// Samples along both sides of the segments, each of this weight: there the values, less `target` of the point, are affine. With `upright`, what
/// the values of things at one distance have for slopes along x and y, those of upright segments are of one distance.
pub(super) fn along(
    mesh: &Mesh,
    segments: &[LineSegment],
    (w, h): (usize, usize),
    weight: f64,
    target: &dyn Fn([f64; 2]) -> f64,
    upright: Option<[f64; 2]>,
) -> Vec<Line> {
    let mut lines = Vec::new();
    for segment in segments {
        let length = segment.length();
        let [[x, y], [u, v]] = [segment.start, segment.end];
        let (dx, dy) = (u - x, v - y);
        let upright = upright.filter(|_| dx.abs() < TILT * dy.abs());
        let distant = |[x, y]: [f64; 2]| upright.map_or(0.0, |[a, b]| a * x + b * y);
        let count = ((2.0 * length / mesh.spacing) as usize).max(4);
        for side in [-BESIDE, BESIDE] {
            let (mut terms, mut along) = (Vec::new(), Vec::new());
            for k in 0..count {
                let t = k as f64 / (count - 1) as f64;
                let point = [x + dx * t - dy / length * side, y + dy * t + dx / length * side];
                let within = |p: f64, side: usize| p >= 0.0 && p <= (side - 1) as f64;
                if within(point[0], w) && within(point[1], h) {
                    let (nodes, coefficients) = mesh.cell(point);
                    let target = target(point) + distant(point);
                    terms.push(Term { nodes, coefficients, target, weight });
                    along.push(t);
                }
            }
            if terms.len() > 2 {
                let weights = vec![0.0; terms.len()];
                lines.push(Line { terms, along, weights, weight, constant: upright.is_some() });
            }
        }
    }
    lines
}

impl Line {
    /// Slope and intercept that fit the values best; no slope where they are to be constant.
    fn affine(&self, value: &dyn Fn(&Term) -> f64) -> [f64; 2] {
        let mut fit = LineFit::default();
        for ((&weight, &along), term) in self.weights.iter().zip(&self.along).zip(&self.terms) {
            fit.add(along, value(term), weight);
        }
        fit.line().filter(|_| !self.constant).unwrap_or_else(|| [0.0, fit.constant()])
    }

    pub fn reweight(&mut self, x: &[f64], pass: usize) {
        if pass == 0 {
            self.weights.fill(self.weight);
            return;
        }
        let [a, b] = self.affine(&|term| term.residual(x));
        let scale = if self.constant { UPRIGHT } else { 1.0 };
        for ((w, term), t) in self.weights.iter_mut().zip(&self.terms).zip(&self.along) {
            *w = self.weight * robust((term.residual(x) - a * t - b) / scale, pass >= ROBUST);
        }
    }

    /// Adds this line's share of the normal matrix, times a vector: what pulls its values to the line that fits them best; where the matrix has them
    /// pulled to 0, the rest.
    pub fn add_product(&self, x: &[f64], pulled: bool, out: &mut [f64]) {
        self.add_pull(&|term| term.value(x), pulled, out);
    }

    /// Adds its share of their right side, or the rest of it.
    pub fn add_right(&self, pulled: bool, out: &mut [f64]) {
        self.add_pull(&|term| term.target, pulled, out);
    }

    fn add_pull(&self, value: &dyn Fn(&Term) -> f64, pulled: bool, out: &mut [f64]) {
        let [a, b] = self.affine(value);
        for ((term, w), t) in self.terms.iter().zip(&self.weights).zip(&self.along) {
            let own = if pulled { 0.0 } else { value(term) };
            let pull = w * (own - (a * t + b));
            for (&n, c) in term.nodes.iter().zip(term.coefficients) {
                out[n] += pull * c;
            }
        }
    }
}
