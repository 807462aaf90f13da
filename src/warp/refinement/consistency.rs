//! Where the two refined maps agree.

use crate::Result;
use crate::geometry::Model;
use crate::image::zeroed;

/// Inverse depth at 1/`scale` of a photo's size.
pub(super) struct Map {
    pub data: Vec<f32>,
    pub width: usize,
    pub height: usize,
    pub scale: usize,
}

/// How far along and across the epipolar line a pixel may come back from itself, in pixels of the map: depth only has a
/// say along it, the two models do not quite agree across it.
const TOLERANCE: [f64; 2] = [1.0, 4.0];

/// A pixel that its map sends into the other photo, and one that the other photo's map sends back from there.
const SEEN: u8 = 1;
const AGREES: u8 = 255;

/// Marks the pixels of one photo that are [`SEEN`] in the other, or even [`AGREES`].
pub(super) fn consistent(own: &Map, to: &Model, other: &Map, back: &Model) -> Result<Vec<u8>> {
    let scale = own.scale as f64;
    let middle = (own.scale / 2) as f64;
    let mut agree: Vec<u8> = zeroed(own.data.len())?;
    for (i, (agree, &d)) in agree.iter_mut().zip(&own.data).enumerate() {
        let (x, y) = ((i % own.width) as f64 * scale + middle, (i / own.width) as f64 * scale + middle);
        let Some([u, v]) = to.project(x, y, f64::from(d)) else { continue };
        let block = |p: f64| ((p - middle) / scale + 0.5).floor();
        let (bu, bv) = (block(u), block(v));
        if !(bu >= 0.0 && bv >= 0.0 && bu < other.width as f64 && bv < other.height as f64) {
            continue;
        }
        *agree = SEEN;
        let there = f64::from(other.data[bv as usize * other.width + bu as usize]);
        let [bx, by, bw] = back.transform(u, v, there);
        let inverse = if bw > 0.0 { 1.0 / bw } else { continue };
        let (bx, by) = (bx * inverse, by * inverse);
        let (gx, gy) = (back.e[0] - bx * back.e[2], back.e[1] - by * back.e[2]);
        let (dx, dy) = (bx - x, by - y);
        let length = (gx * gx + gy * gy).sqrt() * scale;
        let (along, across) = ((dx * gx + dy * gy).abs(), (dx * gy - dy * gx).abs());
        if along <= TOLERANCE[0] * length && across <= TOLERANCE[1] * length {
            *agree = AGREES;
        }
    }
    Ok(agree)
}

/// Half the window of [`solid`].
const RADIUS: usize = 2;
/// Of the window's pixels that many have to agree: a third.
const ENOUGH: u32 = ((2 * RADIUS + 1) * (2 * RADIUS + 1)) as u32 / 3;

/// The pixels that agree with enough others around: agreement of single pixels is chance.
pub(super) fn solid(marks: &[u8], width: usize, height: usize) -> Result<Vec<u8>> {
    let mut kept: Vec<u8> = zeroed(marks.len())?;
    let mut columns = vec![0u32; width + 2 * RADIUS];
    for y in 0..height {
        let window = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
        for (x, column) in columns[RADIUS..RADIUS + width].iter_mut().enumerate() {
            *column = window.clone().map(|y| u32::from(marks[y * width + x] == AGREES)).sum();
        }
        for (x, around) in columns.windows(2 * RADIUS + 1).enumerate() {
            let at = y * width + x;
            if marks[at] == AGREES && around.iter().sum::<u32>() > ENOUGH {
                kept[at] = 255;
            }
        }
    }
    Ok(kept)
}
