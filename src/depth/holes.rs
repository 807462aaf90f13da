//! Holes of depth maps, and how they are filled.

use std::borrow::Cow;

use wide::f32x4;

use crate::image::zeroed;
use crate::{InverseDepth, Result};

/// How pixels without a depth value are handled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Holes {
    /// They get the value of the nearest pixel that has one; void recovery removes most of the errors.
    #[default]
    Nearest,
    /// Cells of the target at a hole are not drawn, reference pixels at a hole are void.
    Drop,
}

const UNKNOWN: u32 = u32::MAX;

/// The depth map to warp with: as it is, or with its holes filled from the nearest known pixel.
pub(crate) fn resolve(depth: Option<&InverseDepth>, holes: Holes) -> Result<Option<Cow<'_, InverseDepth>>> {
    let Some(depth) = depth else { return Ok(None) };
    Ok(Some(if holes == Holes::Nearest && has_holes(depth.data()) {
        Cow::Owned(fill_nearest(depth)?)
    } else {
        Cow::Borrowed(depth)
    }))
}

fn has_holes(values: &[f32]) -> bool {
    let (lanes, rest) = values.as_chunks();
    let holes = lanes.iter().fold(f32x4::splat(0.0), |holes, &v| holes | f32x4::new(v).is_nan());
    holes.any() || rest.iter().any(|v| v.is_nan())
}

/// Fills every hole with the value of the nearest known pixel, found by propagating nearest sources in two sweeps
/// (Danielsson 1980). A map without any value stays as it is.
fn fill_nearest(depth: &InverseDepth) -> Result<InverseDepth> {
    let (w, h) = depth.size();
    let mut source: Vec<u32> = zeroed(w * h)?;
    for (at, (source, value)) in source.iter_mut().zip(depth.data()).enumerate() {
        *source = if value.is_nan() { UNKNOWN } else { at as u32 };
    }
    let distance2 = |source: u32, (x, y): (usize, usize)| {
        let (dx, dy) = ((source as usize % w).abs_diff(x) as u64, (source as usize / w).abs_diff(y) as u64);
        dx * dx + dy * dy
    };
    let mut relax = |(x, y): (usize, usize), neighbour: usize| {
        let at = y * w + x;
        let (own, candidate) = (source[at], source[neighbour]);
        // Most pixels are known, or have the source of their neighbour already.
        if own == at as u32 || candidate == own || candidate == UNKNOWN {
            return;
        }
        if own == UNKNOWN || distance2(candidate, (x, y)) < distance2(own, (x, y)) {
            source[at] = candidate;
        }
    };
    let downwards = (0..h).map(|y| (y, y.checked_sub(1)));
    let upwards = (0..h).rev().map(|y| (y, Some(y + 1).filter(|&below| below < h)));
    for (y, before) in downwards.chain(upwards) {
        if let Some(before) = before {
            for x in 0..w {
                // At the border one of them is taken twice, which changes nothing.
                for other in [x, x.saturating_sub(1), (x + 1).min(w - 1)] {
                    relax((x, y), before * w + other);
                }
            }
        }
        let leftwards = (1..w).rev().map(|x| (x - 1, x));
        for (x, other) in (1..w).map(|x| (x, x - 1)).chain(leftwards) {
            relax((x, y), y * w + other);
        }
    }
    let values = depth.data();
    depth.map_indexed(|at, v| if source[at] == UNKNOWN { v } else { values[source[at] as usize] })
}
