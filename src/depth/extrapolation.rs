//! Smooth continuation of inverse depth to where it is not known.

use super::interpolation::{Kernel, Sample, Scattered, diagonal};
use super::pull_push::Level;
use crate::geometry::{DepthSample, Model, dominant_plane, plane_depth};
use crate::image::{check_size, reserve};
use crate::observer::{Observer, report};
use crate::{InverseDepth, Mask, Result, Stage};

/// What lies closer to the other photo's border than this, in its pixels, was matched badly.
const MARGIN: f64 = 3.0;
/// The same where hardly any pixel is trusted, one in so many; as a share of the diagonal.
const UNSURE_MARGIN: f64 = 0.027;
const FEW: usize = 10;
/// The photo's diagonal in lattice steps; the known pixels on the lattice determine all but the details.
const LATTICE: f64 = 80.0;
/// The fewest of them that say anything.
const FEWEST: usize = 20;
/// How far details reach, as a share of the diagonal.
const REACH: f64 = 0.03;
/// Steep slopes at the border must not run away, and what fades must not stretch.
const KERNEL: Kernel = Kernel { near: 0.015, ridge: 1e-3, far: 0.3, sharp: false, nodes: 75.0 };

/// Replaces the inverse depth of all pixels that `model` sends outside the `other` photo (width, height).
///
/// Far outside it is that of the plane that most of the pixels inside are near to, so that straight lines stay straight;
/// next to the border it goes on as inside, by local planes that slowly fade away. A map that is a plane inside is that
/// plane everywhere. `trusted` tells which pixels have a say (all of them by default); where they are hardly any, those
/// near the border have none.
///
/// Returns the map as it is when hardly any pixel is inside.
///
/// # Errors
/// `size-mismatch` for a mask of another size, `out-of-memory`, `aborted`.
pub fn continue_outside(
    depth: &InverseDepth,
    model: &Model,
    other: (usize, usize),
    trusted: Option<&Mask>,
    observer: &mut dyn Observer,
) -> Result<InverseDepth> {
    let (w, size) = (depth.width(), (depth.width(), depth.height()));
    if let Some(mask) = trusted {
        check_size("trusted", (mask.width(), mask.height()), size)?;
    }
    report(observer, Stage::Depth, 0.0)?;
    let unsure = trusted.is_some_and(|mask| mask.count() * FEW < mask.data().len());
    let margin = if unsure { UNSURE_MARGIN * diagonal(size) } else { MARGIN };
    let limit = [other.0, other.1].map(|size| size as f64 - margin);
    let mut inside = Vec::new();
    reserve(&mut inside, depth.data().len())?;
    for (y, row) in depth.data().chunks_exact(w).enumerate() {
        inside.extend(row.iter().enumerate().map(|(x, &d)| {
            let place = model.project(x as f64, y as f64, f64::from(d)).unwrap_or_default();
            let within = place.iter().zip(limit).all(|(p, limit)| *p >= margin && *p < limit);
            if within { d } else { f32::NAN }
        }));
    }
    let inside = InverseDepth::from_values(inside, size.0, size.1);
    report(observer, Stage::Depth, 0.2)?;
    Ok(continued(&inside, model, trusted, observer)?.unwrap_or_else(|| depth.clone()))
}

/// Fills what is not known in `map`; `None` when hardly anything is. `model` tells what differences of depth weigh.
pub(super) fn continued(
    map: &InverseDepth,
    model: &Model,
    trusted: Option<&Mask>,
    observer: &mut dyn Observer,
) -> Result<Option<InverseDepth>> {
    let (w, h, values) = (map.width(), map.height(), map.data());
    let diagonal = diagonal((w, h));
    let step = ((diagonal / LATTICE) as usize).max(1);
    let mut known = Vec::new();
    for y in (0..h).step_by(step) {
        for x in (0..w).step_by(step) {
            let (i, point) = (y * w + x, [x as f64, y as f64]);
            if !values[i].is_nan() && trusted.is_none_or(|mask| mask.data()[i] != 0) {
                let depth = f64::from(values[i]);
                known.push(DepthSample { point, depth, parallax: model.parallax(point, depth) });
            }
        }
    }
    let Some(plane) = (known.len() >= FEWEST).then(|| dominant_plane(&known, 1.0)).flatten() else { return Ok(None) };
    let samples: Vec<Sample> = known
        .iter()
        .map(|m| Sample { point: m.point, value: m.depth - plane_depth(plane, m.point), weight: 1.0 })
        .collect();
    let mut filled = Scattered::new(&samples, KERNEL, (w, h), None).dense(observer)?.into_values();
    for (y, row) in filled.chunks_exact_mut(w).enumerate() {
        let start = plane_depth(plane, [0.0, y as f64]);
        row.iter_mut().enumerate().for_each(|(x, v)| *v = (f64::from(*v) + start + plane[0] * x as f64) as f32);
    }
    // What is known deviates from that by the details.
    let details = Level::of(w, &filled, values, trusted)?.continued(0.5 * REACH * diagonal)?;
    for (y, (row, known)) in filled.chunks_exact_mut(w).zip(values.chunks_exact(w)).enumerate() {
        for (x, (filled, &known)) in row.iter_mut().zip(known).enumerate() {
            *filled = if known.is_nan() { *filled + details.above(x, y) } else { known };
        }
    }
    Ok(Some(InverseDepth::from_values(filled, w, h)))
}
