//! The target, displaced.

use std::ops::Range;

use wide::{f32x4, i32x4};

use super::field::Field;
use crate::each_row::for_each_row;
use crate::image::reserve;
use crate::observer::{Observer, report_row};
use crate::{Image, Result, Stage};

/// Displacements below this many pixels are none.
const LEAST: f32 = 0.02;

/// Displaces the target in the region (columns, rows) by a field whose nodes are squares of so many pixels.
pub(super) fn displace(
    image: &mut Image,
    (columns, rows): &(Range<usize>, Range<usize>),
    (field, side): (&Field, usize),
    observer: &mut dyn Observer,
) -> Result<()> {
    let canvas = image.width();
    let mut source = Vec::new();
    reserve(&mut source, columns.len() * rows.len())?;
    for y in rows.clone() {
        source.extend_from_slice(&image.pixels()[y * canvas + columns.start..y * canvas + columns.end]);
    }
    let source = Source { pixels: &source, width: columns.len(), height: rows.len() };
    let node = |p: usize| (p as f32 + 0.5) / side as f32 - 0.5;
    for_each_row(0..source.height, &mut |y| {
        report_row(observer, Stage::Blend, y, source.height)?;
        let moving = (0..field.width).filter(|&i| !field.is_still(i, y / side));
        for x in moving.flat_map(|i| i * side..((i + 1) * side).min(source.width)) {
            if source.pixels[y * source.width + x][3] == 0 {
                continue;
            }
            let [u, v] = field.at(node(x), node(y)).map(|v| v * side as f32);
            if u * u + v * v < LEAST * LEAST {
                continue;
            }
            let at = (rows.start + y) * canvas + columns.start + x;
            // Next to masked pixels it stays as it is.
            if let Some(pixel) = source.sample(x as f32 + u, y as f32 + v) {
                image.pixels_mut()[at] = pixel;
            }
        }
        Ok(())
    })
}

struct Source<'a> {
    pixels: &'a [[u8; 4]],
    width: usize,
    height: usize,
}

impl Source<'_> {
    /// Catmull and Rom's cubic interpolation, bilinear next to masked pixels; `None` where one of the four pixels is masked.
    fn sample(&self, x: f32, y: f32) -> Option<[u8; 4]> {
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        if i + 1 >= self.width || j + 1 >= self.height {
            return None;
        }
        let (u, v) = (x - i as f32, y - j as f32);
        let inner = i > 0 && j > 0 && i + 2 < self.width && j + 2 < self.height;
        let cubic = if inner { self.weighted([i - 1, j - 1], cubic(u), cubic(v)) } else { None };
        cubic.or_else(|| self.weighted([i, j], [1.0 - u, u], [1.0 - v, v]))
    }

    /// The weighted mean of N×N pixels; `None` where one of them is masked.
    #[inline(always)]
    fn weighted<const N: usize>(&self, [i, j]: [usize; 2], across: [f32; N], down: [f32; N]) -> Option<[u8; 4]> {
        let mut sum = f32x4::splat(0.5);
        let mut all = u32::MAX;
        for (row, weight) in down.into_iter().enumerate() {
            let from = (j + row) * self.width + i;
            let mut line = f32x4::ZERO;
            for (pixel, weight) in self.pixels.get(from..from + N)?.iter().zip(across) {
                let pixel = u32::from_le_bytes(*pixel);
                all &= pixel;
                line += colour(pixel) * f32x4::splat(weight);
            }
            sum += line * f32x4::splat(weight);
        }
        // All bits of alpha are set, or none.
        if all >> 24 == 0 {
            return None;
        }
        let [r, g, b, _] = sum.to_array().map(|v| v as u8);
        Some([r, g, b, 255])
    }
}

/// Red, green and blue of a pixel as one word.
#[inline(always)]
fn colour(pixel: u32) -> f32x4 {
    // Each where it lies in the word, and then scaled, neither of which rounds.
    let bytes = i32x4::splat(pixel as i32) & i32x4::new([0xff, 0xff00, 0xff_0000, 0]);
    f32x4::from_i32x4(bytes) * f32x4::new([1.0, 1.0 / 256.0, 1.0 / 65536.0, 0.0])
}

/// Weights of four neighbours, from the one before the pixel that this is a fraction beyond.
fn cubic(t: f32) -> [f32; 4] {
    let (square, cube) = (t * t, t * t * t);
    [
        0.5 * (-cube + 2.0 * square - t),
        0.5 * (3.0 * cube - 5.0 * square + 2.0),
        0.5 * (-3.0 * cube + 4.0 * square + t),
        0.5 * (cube - square),
    ]
}
