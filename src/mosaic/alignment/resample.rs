//! The target, displaced.

use std::ops::Range;

use wide::f32x4;

use super::field::Field;
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
    for y in 0..source.height {
        report_row(observer, Stage::Blend, y, source.height)?;
        for x in 0..source.width {
            if field.is_still(x / side, y / side) || source.pixels[y * source.width + x][3] == 0 {
                continue;
            }
            let [u, v] = field.at(node(x), node(y)).map(|v| v * side as f32);
            if u * u + v * v < LEAST * LEAST {
                continue;
            }
            let at = (rows.start + y) * canvas + columns.start + x;
            // Next to what is not there it stays as it is.
            if let Some(pixel) = source.sample(x as f32 + u, y as f32 + v) {
                image.pixels_mut()[at] = pixel;
            }
        }
    }
    Ok(())
}

struct Source<'a> {
    pixels: &'a [[u8; 4]],
    width: usize,
    height: usize,
}

impl Source<'_> {
    /// Catmull and Rom's cubic interpolation, bilinear next to what is not there; `None` where that is one of the four pixels.
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

    /// The weighted mean of N×N pixels; `None` where one of them is not there.
    fn weighted<const N: usize>(&self, [i, j]: [usize; 2], across: [f32; N], down: [f32; N]) -> Option<[u8; 4]> {
        let mut sum = f32x4::splat(0.5);
        for (row, weight) in down.into_iter().enumerate() {
            let from = (j + row) * self.width + i;
            let mut line = f32x4::ZERO;
            for (pixel, weight) in self.pixels.get(from..from + N)?.iter().zip(across) {
                if pixel[3] == 0 {
                    return None;
                }
                line += f32x4::new(pixel.map(f32::from)) * f32x4::splat(weight);
            }
            sum += line * f32x4::splat(weight);
        }
        let [r, g, b, _] = sum.to_array().map(|v| v as u8);
        Some([r, g, b, 255])
    }
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
