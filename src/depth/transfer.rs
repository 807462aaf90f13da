//! The other photo's inverse depth from one map.

use super::completion::{CompletionOptions, KnownDepth};
use super::surface::OtherView;
use crate::geometry::{Calibration, EstimateOptions, Frame, Match, Model, ModelKind, estimate};
use crate::image::{area, filled, reserve, zeroed};
use crate::observer::{Observer, Portion, report};
use crate::{InverseDepth, Result, Stage};

/// Inverse depth of the `other` photo (width, height), from the map of the first and the `model` that takes it there.
///
/// What the first photo shows with d appears in the other with d/λ, λ being the third coordinate of its image; the model
/// back is [`Model::inverse`]. Where several pixels land on one, the nearest, of the largest d, is visible. What the first
/// photo does not show is completed, as [`super::complete_depth`] does. Holes of the map land nowhere.
///
/// `None` when hardly any of the map lands on the other photo, or the model has no inverse.
///
/// # Errors
/// `invalid-argument` for an empty side of the other photo, `out-of-memory`, `aborted`.
pub fn derive_depth(
    depth: &InverseDepth,
    model: &Model,
    other: (usize, usize),
    observer: &mut dyn Observer,
) -> Result<Option<InverseDepth>> {
    let Some(reverse) = model.inverse() else { return Ok(None) };
    let (w, h) = other;
    let pixels = area("other", w, h)?;
    let mut seen = filled(pixels, f32::NAN)?;
    // The d in front; 0 also where nothing is.
    let mut front: Vec<f32> = zeroed(pixels)?;
    for_each_landing(depth, model, other, observer, &mut |i, value, d| {
        if seen[i].is_nan() || d > front[i] {
            (seen[i], front[i]) = (value, d);
        }
    })?;
    let seen = InverseDepth::from_values(seen, w, h);
    let other = OtherView::new(&reverse, depth.size());
    KnownDepth::new(seen, None, other, &[], observer)?.completed(&CompletionOptions::default())
}

/// Calls `put` with the index of every pixel of the `other` photo (width, height) that a pixel of the map covers there, its
/// inverse depth in that photo, and in its own.
fn for_each_landing(
    depth: &InverseDepth,
    model: &Model,
    (w, h): (usize, usize),
    observer: &mut dyn Observer,
    put: &mut dyn FnMut(usize, f32, f32),
) -> Result<()> {
    // Where the pixels of a row land, and their depth there.
    let land = |y: usize, out: &mut Vec<Option<([f64; 2], f32)>>| {
        out.clear();
        let row = depth.data().chunks_exact(depth.width()).nth(y).unwrap_or_default();
        out.extend(row.iter().enumerate().map(|(x, &d)| {
            let [u, v, third] = model.transform(x as f64, y as f64, f64::from(d));
            (third > 0.0).then(|| ([u / third, v / third], (f64::from(d) / third) as f32))
        }));
    };
    let (mut here, mut below) = (Vec::new(), Vec::new());
    reserve(&mut here, depth.width())?;
    reserve(&mut below, depth.width())?;
    land(0, &mut below);
    for (y, depths) in depth.data().chunks_exact(depth.width()).enumerate() {
        if y % 256 == 0 {
            report(observer, Stage::Depth, 0.2 * y as f32 / depth.height() as f32)?;
        }
        std::mem::swap(&mut here, &mut below);
        land(y + 1, &mut below);
        for (x, &d) in depths.iter().enumerate() {
            let Some((place, value)) = here[x] else { continue };
            // Half the size of the projected pixel, so that no gaps are left where the other photo is closer.
            let mut half = [0.5; 2];
            for next in [here.get(x + 1), below.get(x)] {
                if let Some(&Some((next, _))) = next {
                    for k in 0..2 {
                        let apart = 0.5 * (next[k] - place[k]).abs();
                        // Neighbours farther apart belong to different surfaces.
                        if apart > half[k] && apart < 1.5 {
                            half[k] = apart;
                        }
                    }
                }
            }
            let range = |k: usize, size: usize| {
                // The casts take what is negative for zero.
                (place[k] - half[k]).ceil() as usize..(((place[k] + half[k]).floor() + 1.0) as usize).min(size)
            };
            for v in range(1, h) {
                for u in range(0, w) {
                    put(v * w + u, value, d);
                }
            }
        }
    }
    Ok(())
}

/// The missing one of two maps: of the photo whose frame has none, derived from the other's by the model that the matches
/// fix with that one alone.
///
/// `None` when not exactly one is missing, and when the map that is there gives no model with parallax.
///
/// # Errors
/// Those of [`estimate`]; `out-of-memory`, `aborted`.
pub fn derive_missing(
    matches: &[Match],
    target: Frame<'_>,
    reference: Frame<'_>,
    options: &EstimateOptions,
    observer: &mut dyn Observer,
) -> Result<Option<InverseDepth>> {
    let swapped: Vec<Match>;
    let (matches, from, depth, to) = match (target.depth, reference.depth) {
        (Some(depth), None) => (matches, target, depth, reference),
        (None, Some(depth)) => {
            swapped = matches.iter().map(|m| Match { target: m.reference, reference: m.target }).collect();
            (&swapped[..], reference, depth, target)
        }
        _ => return Ok(None),
    };
    // The model from the one photo to the other does not depend on the other's depth: any map that is not a plane will do.
    let (w, h) = to.size;
    let saddle = InverseDepth::constant(0.0, w, h)?
        .map_indexed(|i, _| ((i % w) as f64 / w as f64 * ((i / w) as f64 / h as f64)) as f32)?;
    let options = EstimateOptions { calibration: Calibration::Off, ..options.clone() };
    let found =
        estimate(matches, from, Frame { depth: Some(&saddle), ..to }, &options, &mut Portion::new(observer, 0.0, 0.7))?;
    if found.kind == ModelKind::Homography {
        return Ok(None);
    }
    derive_depth(depth, &found.forward, to.size, &mut Portion::new(observer, 0.7, 1.0))
}
