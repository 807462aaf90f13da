//! The inverse depth of the background behind each void.

use super::level::{Level, Void};
use crate::Result;
use crate::image::filled;

/// Steps in eight directions (as x, y).
const DIRECTIONS: [(isize, isize); 8] = [(1, 0), (2, 1), (1, 1), (1, 2), (0, 1), (-1, 2), (-1, 1), (-2, 1)];
/// The pixels at a void's border mix both sides: depth is read so many pixels further on.
const BEYOND: usize = 3;
/// The cost of a chord with an end where nothing is known: that of one at 45° to the epipolar line.
const OPEN_END: f32 = 0.5;
/// Where between the background and what is in front of it the limit lies.
const SHARE: f32 = 0.5;

/// Finds the background's depth for every void. A void lies between the thing in front that tore it open and the
/// background that came to light, and both moved along the lines through the epipole: of the two ends of such a line
/// within the void the farther one is background. Without an epipole the shortest chord is taken.
pub(super) fn set_limits(level: &mut Level, epipole: [f64; 3]) -> Result<()> {
    let tolerance = SHARE * 0.2 * mean_absolute_deviation(level);
    let mut least = filled(level.voids.len(), f32::INFINITY)?;
    for (dx, dy) in DIRECTIONS {
        let step = dy * level.width.cast_signed() + dx;
        let length = ((dx * dx + dy * dy) as f32).sqrt();
        for first in 0..level.voids.len() {
            let start = level.voids[first].cell;
            let before = start.wrapping_add_signed(-step);
            if level.index[before] != 0 {
                continue; // within a chord
            }
            let (mut end, mut chord) = (start, 0.0);
            while level.index[end] != 0 {
                (end, chord) = (end.wrapping_add_signed(step), chord + length);
            }
            let ends = [beyond(level, before, -step), beyond(level, end, step)];
            let known = || ends.into_iter().filter(|depth| depth.is_finite());
            let (far, near) = (known().fold(f32::INFINITY, f32::min), known().fold(f32::NEG_INFINITY, f32::max));
            if near < far {
                continue; // neither end is known
            }
            let limit = (far + (SHARE * (near - far)).max(tolerance)).min(f32::MAX);
            let open = if known().count() < 2 { OPEN_END } else { 0.0 };
            let mut at = start;
            while at != end {
                let number = level.index[at] as usize - 1;
                let (x, y) = level.position(at);
                let (ex, ey) = (epipole[0] - x as f64 * epipole[2], epipole[1] - y as f64 * epipole[2]);
                let across = ex * dy as f64 - ey * dx as f64;
                let square = (ex * ex + ey * ey) * f64::from(length) * f64::from(length);
                let off = if square > 0.0 { (across * across / square) as f32 } else { 0.0 };
                // The length decides where nothing else does.
                let cost = off + open + 1e-6 * chord;
                if cost < least[number] {
                    least[number] = cost;
                    level.voids[number] = Void { cell: at, far, limit };
                }
                at = at.wrapping_add_signed(step);
            }
        }
    }
    propagate_background(level, tolerance);
    Ok(())
}

/// Where both ends are about as far away, both may be in front, and so they may be where what a neighbour has behind it is farther away by
/// more than they are apart. So what lies farther away next to such voids is taken over, and handed on.
fn propagate_background(level: &mut Level, tolerance: f32) {
    for backwards in [false, true, false] {
        for i in 0..level.voids.len() {
            let number = if backwards { level.voids.len() - 1 - i } else { i };
            let cell = level.voids[number].cell;
            let row = if backwards { cell + level.width } else { cell - level.width };
            let side = if backwards { cell + 1 } else { cell - 1 };
            for neighbour in [row - 1, row, row + 1, side] {
                let Some(other) = level.voids.get((level.index[neighbour] as usize).wrapping_sub(1)) else { continue };
                let void = level.voids[number];
                let farther = void.far - other.far;
                let ambiguous = void.limit - void.far <= tolerance.max(SHARE * farther);
                if ambiguous && farther > 0.0 && other.limit - other.far > tolerance {
                    level.voids[number] = Void { cell, ..*other };
                }
            }
        }
    }
}

/// Depth a few pixels from a border, or at the last known one before; not finite if there is none.
fn beyond(level: &Level, mut at: usize, step: isize) -> f32 {
    let mut depth = level.depth[at];
    for _ in 0..BEYOND {
        if depth == f32::INFINITY {
            break;
        }
        at = at.wrapping_add_signed(step);
        let next = level.depth[at];
        if next == f32::INFINITY {
            break;
        }
        depth = next;
    }
    depth
}

/// Mean absolute deviation of the known depths from their mean.
fn mean_absolute_deviation(level: &Level) -> f32 {
    let known = || level.depth.iter().filter(|d| d.is_finite()).map(|&d| f64::from(d));
    let count = known().count().max(1) as f64;
    let mean = known().sum::<f64>() / count;
    (known().map(|d| (d - mean).abs()).sum::<f64>() / count) as f32
}
