//! Both photos around the seam, at one resolution.

use std::ops::Range;

use crate::distance::{STRAIGHT, distance};
use crate::image::reserve;
use crate::luma::rec601;
use crate::mosaic::canvas::Placed;
use crate::{Image, Mask, Result};

/// Nodes of one resolution, each a square of pixels.
pub(super) struct Level {
    pub width: usize,
    pub height: usize,
    /// Mean luma of the target and of the reference; NaN where any pixel of the square is not there.
    pub target: Vec<f32>,
    pub reference: Vec<f32>,
    /// Distance from the seam, in diagonals of the reference.
    pub distance: Vec<f32>,
}

impl Level {
    /// Squares of `side` pixels of the region (columns, rows) of the canvas; `length` is the reference's diagonal in nodes.
    pub fn finest(
        image: &Image,
        reference: &Placed<'_>,
        seam: &Mask,
        (columns, rows): &(Range<usize>, Range<usize>),
        side: usize,
        length: f64,
    ) -> Result<Self> {
        let (width, height) = (columns.len().div_ceil(side), rows.len().div_ceil(side));
        let (mut target, mut other, mut labels) = (Vec::new(), Vec::new(), Vec::new());
        reserve(&mut target, width * height)?;
        reserve(&mut other, width * height)?;
        reserve(&mut labels, width * height)?;
        let canvas = image.width();
        let share = 1.0 / (side * side) as f32;
        for (j, i) in (0..height).flat_map(|j| (0..width).map(move |i| (j, i))) {
            let (left, top) = (columns.start + i * side, rows.start + j * side);
            let (mut sums, mut count) = ([0.0f32; 2], 0);
            for y in top..(top + side).min(rows.end) {
                let row = reference.row(y);
                for x in left..(left + side).min(columns.end) {
                    let own = image.pixels()[y * canvas + x];
                    sums[0] += if own[3] == 0 { f32::NAN } else { rec601(own) };
                    sums[1] += reference.pixel(row, x).map_or(f32::NAN, rec601);
                    count += 1;
                }
            }
            let share = if count == side * side { share } else { f32::NAN };
            target.push(sums[0] * share);
            other.push(sums[1] * share);
            let middle = [(left + side / 2).min(columns.end - 1), (top + side / 2).min(rows.end - 1)];
            labels.push(seam.data()[middle[1] * canvas + middle[0]]);
        }
        let meets = |at: usize| {
            let next = |beyond: usize| labels.get(at + beyond).is_some_and(|label| labels[at] ^ label == 3);
            (!(at + 1).is_multiple_of(width) && next(1)) || next(width)
        };
        let scale = 1.0 / (f64::from(STRAIGHT) * length) as f32;
        let steps = distance(width * height, width, &meets)?;
        let mut distance = Vec::new();
        reserve(&mut distance, steps.len())?;
        distance.extend(steps.iter().map(|steps| f32::from(*steps) * scale));
        Ok(Self { width, height, target, reference: other, distance })
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
        Ok(Self { width, height, target: target?, reference: reference?, distance: distance? })
    }

    /// The target's luma at a point, bilinear; NaN outside and next to what is not there.
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
