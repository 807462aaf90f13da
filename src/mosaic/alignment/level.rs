//! Both photos around the seam, at one resolution.

use std::ops::Range;

use super::field::COMPARED;
use crate::distance::{STRAIGHT, distance};
use crate::each_row::for_each_row;
use crate::image::reserve;
use crate::luma::rec601;
use crate::mosaic::canvas::Placed;
use crate::mosaic::seam::{REFERENCE, passes_between};
use crate::{Image, Mask, Result};

/// Nodes of one resolution, each a square of pixels.
pub(super) struct Level {
    /// Where the first square begins on the canvas, and the side of each, in pixels.
    pub origin: [usize; 2],
    pub side: usize,
    pub width: usize,
    pub height: usize,
    /// Mean luma of the target and of the reference; NaN where any pixel of the square is masked, and far from the seam.
    pub target: Vec<f32>,
    pub reference: Vec<f32>,
    /// Distance from the seam, in diagonals of the reference; ∞ where only the reference shows and the photos are not compared: nothing
    /// has to move there.
    pub distance: Vec<f32>,
    /// Which photo shows in the middle of a square; none for a halved level.
    pub labels: Vec<u8>,
}

impl Level {
    /// Squares of `side` pixels of the region (columns, rows) of the canvas, within `reach` of the seam; `length` is the reference's diagonal in pixels.
    pub fn finest(
        image: &Image,
        reference: &Placed<'_>,
        seam: &Mask,
        (columns, rows): &(Range<usize>, Range<usize>),
        reach: f32,
        side: usize,
        length: f64,
    ) -> Result<Self> {
        let (width, height) = (columns.len().div_ceil(side), rows.len().div_ceil(side));
        let canvas = image.width();
        let mut labels = Vec::new();
        reserve(&mut labels, width * height)?;
        let middle = |i: usize, range: &Range<usize>| (range.start + i * side + side / 2).min(range.end - 1);
        for row in (0..height).map(|j| &seam.data()[middle(j, rows) * canvas..][..canvas]) {
            labels.extend((0..width).map(|i| row[middle(i, columns)]));
        }
        let meets = |at: usize| {
            let next = |beyond: usize| labels.get(at + beyond).is_some_and(|&label| passes_between(labels[at], label));
            (!(at + 1).is_multiple_of(width) && next(1)) || next(width)
        };
        let scale = (side as f64 / (f64::from(STRAIGHT) * length)) as f32;
        let steps = distance(width * height, width, &meets)?;
        let mut distance = Vec::new();
        reserve(&mut distance, steps.len())?;
        distance.extend(steps.iter().zip(&labels).map(|(steps, &label)| {
            let distance = f32::from(*steps) * scale;
            if label == REFERENCE && distance > COMPARED { f32::INFINITY } else { distance }
        }));
        drop(steps);
        let (mut target, mut other) = (Vec::new(), Vec::new());
        reserve(&mut target, width * height)?;
        reserve(&mut other, width * height)?;
        let whole = (columns.len() / side, rows.len() / side);
        let share = 1.0 / (side * side) as f32;
        for_each_row(0..height, &mut |j| {
            for i in 0..width {
                let mut sums = [f32::NAN; 2];
                if i < whole.0 && j < whole.1 && distance[j * width + i] < reach {
                    sums = [0.0; 2];
                    let (left, top) = (columns.start + i * side, rows.start + j * side);
                    for y in top..top + side {
                        let row = reference.row(y);
                        for (x, own) in (left..).zip(&image.pixels()[y * canvas + left..][..side]) {
                            sums[0] += if own[3] == 0 { f32::NAN } else { rec601(*own) };
                            sums[1] += reference.pixel(row, x).map_or(f32::NAN, rec601);
                        }
                    }
                }
                target.push(sums[0] * share);
                other.push(sums[1] * share);
            }
            Ok(())
        })?;
        let origin = [columns.start, rows.start];
        Ok(Self { origin, side, width, height, target, reference: other, distance, labels })
    }

    /// Half the resolution.
    pub fn halved(&self) -> Result<Self> {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let of = |values: &[f32]| -> Result<Vec<f32>> {
            let mut out = Vec::new();
            reserve(&mut out, width * height)?;
            out.extend((0..width * height).map(|at| {
                let at = |x: usize, y: usize| {
                    let (x, y) = (2 * (at % width) + x, 2 * (at / width) + y);
                    values[y.min(self.height - 1) * self.width + x.min(self.width - 1)]
                };
                0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
            }));
            Ok(out)
        };
        let [target, reference, distance] = [&self.target, &self.reference, &self.distance].map(|values| of(values));
        let (origin, side, labels) = (self.origin, 2 * self.side, Vec::new());
        Ok(Self { origin, side, width, height, target: target?, reference: reference?, distance: distance?, labels })
    }

    /// A point of the canvas in nodes.
    pub fn in_nodes(&self, point: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (point[k] + 0.5 - self.origin[k] as f64) / self.side as f64 - 0.5)
    }

    /// A point in nodes on the canvas.
    pub fn on_canvas(&self, point: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (point[k] + 0.5) * self.side as f64 - 0.5 + self.origin[k] as f64)
    }

    /// The node at a point in nodes; `None` outside.
    pub fn node(&self, point: [f64; 2]) -> Option<usize> {
        let [x, y] = point.map(|p| (p + 0.5).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then_some(y as usize * self.width + x as usize)
    }

    /// The target's luma at a point, bilinear; NaN outside and next to masked pixels.
    pub fn luma(&self, x: f32, y: f32) -> f32 {
        if !(x >= 0.0 && y >= 0.0) {
            return f32::NAN;
        }
        let (i, j) = (x as usize, y as usize);
        if i + 1 >= self.width || j + 1 >= self.height {
            return f32::NAN;
        }
        let (u, v, at) = (x - i as f32, y - j as f32, j * self.width + i);
        let row = |at: usize| self.target[at] * (1.0 - u) + self.target[at + 1] * u;
        row(at) * (1.0 - v) + row(at + self.width) * v
    }
}
