//! Straight edges that cross the seam, after J. Jia and C.-K. Tang, *Image Stitching Using Structure Deformation*, IEEE TPAMI 30
//! (2008): optical flow does not find what is thin, as a cable in the sky, once it is torn apart by more than its own width.

use super::field::BAND;
use super::level::Level;
use crate::features::{LineSegment, LineSegmentOptions, line_segments};
use crate::image::{reserve, zeroed};
use crate::mosaic::seam::{REFERENCE, TARGET, passes_between};
use crate::{Image, Result};

/// How far from the seam the photos are looked at, in diagonals.
pub(super) const REACH: f32 = 2.0 * BAND;
/// Shares of the diagonal: length of the shortest edge, how far from its ends it may cross the seam, and how far apart both photos have it at
/// most. At twice as much more lines meet, but bend visibly, and one of ten sets is torn elsewhere.
const SHORTEST: f64 = 0.012;
const GAP: f64 = 0.01;
const MOST_APART: f64 = 0.007;
/// Fewer nodes apart is left to the flow.
const LEAST_APART: f64 = 1.0;
/// Least cosine of the angle between both photos' edges.
const PARALLEL: f64 = 0.996;
/// How far beside an edge the luma of its sides is, in nodes, and along how much of it.
const BESIDE: f64 = 2.5;
const ALONG: i32 = 8;
/// By how many levels the contrast between the sides may differ in both photos, and their mean.
const CONTRAST: f64 = 30.0;
const BRIGHTNESS: f64 = 60.0;
/// Another edge that it could be is this many times as far away, and so many nodes.
const UNIQUE: [f64; 2] = [2.0, 2.0];
/// Half the sides of the window, along the edge and across it, in which moving the target is to lower the deviation of the difference to this
/// share, and below so many levels.
const WINDOW: [i32; 2] = [10, 8];
const GAIN: f64 = 0.5;
const DEVIATION: f64 = 30.0;
/// Weight at the seam, next to squared levels a node.
const WEIGHT: f64 = 3000.0;

/// Where an edge of the reference crosses the seam, and how far to the right of it, looking along it, the target has it: in pixels of the canvas.
pub(super) struct Crossing {
    point: [f64; 2],
    along: [f64; 2],
    offset: f64,
    /// By how much more a pixel farther along.
    slope: f64,
}

/// Finds the edges that both photos have at the seam, on a level with labels. `length` is the reference's diagonal in pixels.
pub(super) fn crossings(level: &Level, length: f64) -> Result<Vec<Crossing>> {
    let length = length / level.side as f64;
    let target = edges(level, &level.target, TARGET, length)?;
    let reference = edges(level, &level.reference, REFERENCE, length)?;
    let mut pairs = Vec::new();
    for (i, own) in target.iter().enumerate() {
        let beside = reference.iter().enumerate().map(|(j, other)| (i, j, own.beside(other, length)));
        pairs.extend(beside.filter_map(|(i, j, crossing)| Some((i, j, crossing?))));
    }
    pairs.retain(|(_, _, crossing)| crossing.is_confirmed(level));
    let unique = |(i, j, crossing): &(usize, usize, Crossing)| {
        let least = UNIQUE[0] * crossing.offset.abs() + UNIQUE[1];
        let near = pairs.iter().filter(|(a, b, other)| (a == i || b == j) && other.offset.abs() < least);
        near.count() == 1
    };
    let unique = pairs.iter().filter(|pair| unique(pair));
    Ok(unique.map(|(_, _, crossing)| crossing.on_canvas(level)).collect())
}

/// What the edges at the seam say of the displacement of each node: a symmetric 2×2 matrix and the right side, in nodes. Empty without edges.
pub(super) fn equations(crossings: &[Crossing], level: &Level, length: f64) -> Result<Vec<[f32; 5]>> {
    let mut equations = zeroed(if crossings.is_empty() { 0 } else { level.distance.len() })?;
    for crossing in crossings {
        crossing.add(level, length, &mut equations);
    }
    Ok(equations)
}

/// The point so far along a line from `start`, and so far to the right of it.
fn beside_line([u, v]: [f64; 2], [x, y]: [f64; 2], along: f64, beside: f64) -> [f64; 2] {
    [u + along * x - beside * y, v + along * y + beside * x]
}

/// A straight edge of one photo that crosses the seam, in nodes.
struct Edge {
    start: [f64; 2],
    along: [f64; 2],
    length: f64,
    /// How far from the start it crosses.
    crossing: f64,
    /// Mean luma to its left and right there.
    sides: [f64; 2],
}

/// The edges of one photo, which shows where the label is `own`.
fn edges(level: &Level, luma: &[f32], own: u8, length: f64) -> Result<Vec<Edge>> {
    let mut pixels = Vec::new();
    reserve(&mut pixels, 4 * luma.len())?;
    pixels.extend(luma.iter().flat_map(|value| {
        let gray = (value + 0.5) as u8;
        [gray, gray, gray, if value.is_nan() { 0 } else { 255 }]
    }));
    let picture = Image::from_bytes(pixels, level.width, level.height);
    let options = LineSegmentOptions { min_length: SHORTEST * length, ..LineSegmentOptions::default() };
    let segments = line_segments(picture.view(), &options)?;
    Ok(segments.iter().filter_map(|segment| Edge::of(segment, level, luma, own, length)).collect())
}

impl Edge {
    fn of(segment: &LineSegment, level: &Level, luma: &[f32], own: u8, diagonal: f64) -> Option<Self> {
        let (start, length) = (segment.start, segment.length());
        let along = [0, 1].map(|k| (segment.end[k] - start[k]) / length);
        let node = |t: f64, beside: f64| level.node(beside_line(start, along, t, beside));
        let gap = GAP * diagonal;
        let (mut before, mut crossing, mut shown) = (0, None, 0);
        for t in (0..(length + 2.0 * gap) as usize).map(|k| k as f64 - gap) {
            let label = node(t, 0.0).map_or(0, |node| level.labels[node]);
            if crossing.is_none() && passes_between(before, label) {
                crossing = Some(t);
            }
            if label == own && t >= 0.0 && t <= length {
                shown += 1;
            }
            before = label;
        }
        // Half of the shortest at least is to be seen.
        let crossing = crossing.filter(|_| f64::from(shown) > 0.5 * SHORTEST * diagonal)?;
        let side = |beside: f64| {
            let places = (-ALONG..=ALONG).map(|k| crossing + f64::from(k)).filter(|t| *t >= 0.0 && *t <= length);
            let values = places.filter_map(|t| Some(luma[node(t, beside)?])).filter(|value| !value.is_nan());
            let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + f64::from(value), count + 1));
            sum / f64::from(count)
        };
        Some(Self { start, along, length, crossing, sides: [side(-BESIDE), side(BESIDE)] })
    }

    /// Where this edge of the target is next to that of the `reference`, if they could be the same.
    fn beside(&self, reference: &Self, diagonal: f64) -> Option<Crossing> {
        let [left, right] = [0, 1].map(|side| self.sides[side] - reference.sides[side]);
        let alike = (left - right).abs() < CONTRAST && (left + right).abs() < 2.0 * BRIGHTNESS;
        let along = reference.along;
        let cosine = self.along[0] * along[0] + self.along[1] * along[1];
        if !alike || cosine < PARALLEL {
            return None;
        }
        let point = beside_line(reference.start, along, reference.crossing, 0.0);
        let [x, y] = [0, 1].map(|k| self.start[k] - point[k]);
        let (ahead, beside) = (x * along[0] + y * along[1], y * along[0] - x * along[1]);
        let slope = (self.along[1] * along[0] - self.along[0] * along[1]) / cosine;
        let offset = beside - ahead * slope;
        let (gap, reached) = (GAP * diagonal, -ahead / cosine);
        let near = reached > -gap && reached < self.length + gap;
        let apart = offset.abs() > LEAST_APART && offset.abs() < MOST_APART * diagonal;
        (near && apart).then_some(Crossing { point, along, offset, slope })
    }
}

impl Crossing {
    /// Whether the photos agree much better around once the target has moved.
    fn is_confirmed(&self, level: &Level) -> bool {
        let [apart, together] = [0.0, 1.0].map(|share| self.deviation(level, share));
        together < (GAIN * apart).min(DEVIATION)
    }

    /// Deviation of the difference of the photos in the window, with the target moved by a share of the offset; NaN where less than half of it
    /// can be compared.
    fn deviation(&self, level: &Level, share: f64) -> f64 {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0);
        for (t, beside) in
            (-WINDOW[0]..=WINDOW[0]).flat_map(|t| (-WINDOW[1]..=WINDOW[1]).map(move |beside| (t, beside)))
        {
            let (t, beside) = (f64::from(t), f64::from(beside));
            let place = |beside: f64| beside_line(self.point, self.along, t, beside);
            let Some(node) = level.node(place(beside)) else { continue };
            let [u, v] = place(beside + share * (self.offset + t * self.slope)).map(|p| p as f32);
            let apart = f64::from(level.luma(u, v) - level.reference[node]);
            if !apart.is_nan() {
                (sum, squares, count) = (sum + apart, squares + apart * apart, count + 1);
            }
        }
        if count < 2 * WINDOW[0] * WINDOW[1] {
            return f64::NAN;
        }
        let mean = sum / f64::from(count);
        (squares / f64::from(count) - mean * mean).max(0.0).sqrt()
    }

    /// From nodes of the level to pixels of the canvas.
    fn on_canvas(&self, level: &Level) -> Self {
        let point = level.on_canvas(self.point);
        Self { point, along: self.along, offset: self.offset * level.side as f64, slope: self.slope }
    }

    /// Adds what it says to the nodes along the edge.
    fn add(&self, level: &Level, length: f64, equations: &mut [[f32; 5]]) {
        let side = level.side as f64;
        let steps = (f64::from(REACH) * length / side) as i32;
        let [x, y] = [-self.along[1], self.along[0]];
        for t in (-steps..=steps).map(|k| f64::from(k) * side) {
            let place = level.in_nodes(beside_line(self.point, self.along, t, 0.0));
            let Some(node) = level.node(place) else { continue };
            let near = f64::from(level.distance[node] / BAND);
            let weight = WEIGHT * libm::exp(-near * near);
            let offset = (self.offset + t * self.slope) / side;
            let added = [x * x, x * y, y * y, x * offset, y * offset];
            equations[node].iter_mut().zip(added).for_each(|(sum, value)| *sum += (weight * value) as f32);
        }
    }
}
