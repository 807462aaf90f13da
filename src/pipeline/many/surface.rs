//! The smooth surface through what is known of a photo's depth: how it goes on beyond that, and how stiff it is.

use nalgebra::Matrix3;

use crate::depth::{Extrapolation, KnownDepth, SurfaceShape};
use crate::features::LineSegment;
use crate::geometry::{DepthSample, Model};
use crate::metrics::bending;
use crate::pipeline::straightness::straightness;
use crate::rect::diagonal;
use crate::{InverseDepth, Result};

/// A surface that bends the outside by more than this, in per cent of the diagonal, had better be a plane. Tuned on pairs.
const MOST_BENDING: f64 = 1.3;
/// If that leaves no more than this share of it: what other photos see was measured, and true depth bends as well.
const RELIEF: f64 = 0.7;
/// How stiff a surface is: where more than this share of the straight lines looks bent, as where thin things are far in front of others, stiffer ones
/// are tried.
const STIFFNESS: [f64; 3] = [1.0, 16.0, 64.0];
const MOST_BENT: f64 = 0.02;
/// One is better that leaves less than this share of it, and aligns less by no more than this share of the diagonal. Tuned on 11 sets.
const LESS_BENT: f64 = 0.5;
const MISALIGNED: f64 = 0.0004;
/// Misalignment beyond this share is all the same.
const MOST_MISALIGNED: f64 = 0.004;

/// The surface through what is known of a photo that has these straight `lines`. `view` leads to the reference, which has the size `reference`.
pub(super) fn surface(
    known: &mut KnownDepth<'_>,
    lines: &[LineSegment],
    view: &Model,
    reference: (usize, usize),
) -> Result<Option<InverseDepth>> {
    let Some(back) = view.h.try_inverse() else { return surface_of(known, STIFFNESS[0], view, reference) };
    // From where the reference was taken, in the photo's own direction.
    let own = Model { h: Matrix3::identity(), e: back * view.e };
    let mut found: Option<(f64, f64, InverseDepth)> = None;
    for stiffness in STIFFNESS {
        let Some(map) = surface_of(known, stiffness, view, reference)? else { continue };
        let bent = straightness(lines, &|[x, y]| own.project(x, y, map.sample(x, y)), &|_| true).bent;
        if found.is_none() && bent <= MOST_BENT {
            return Ok(Some(map));
        }
        let misaligned = misalignment(&map, known)?;
        match &mut found {
            None => found = Some((bent, misaligned + MISALIGNED, map)),
            Some((least, bound, best)) if bent < LESS_BENT * *least && misaligned < *bound => {
                (*least, *best) = (bent, map);
            }
            Some(_) => {}
        }
    }
    Ok(found.map(|(.., map)| map))
}

/// The mean distance of what is known from where the map says, in the other photo and as a share of its diagonal.
fn misalignment(map: &InverseDepth, known: &KnownDepth<'_>) -> Result<f64> {
    let (samples, diagonal) = (known.samples()?, diagonal(known.other().size));
    let distance = |s: &DepthSample| {
        let [x, y] = s.point;
        (((map.sample(x, y) - s.depth) * s.parallax).abs() / diagonal).min(MOST_MISALIGNED)
    };
    Ok(samples.iter().map(distance).sum::<f64>() / samples.len().max(1) as f64)
}

/// A surface of this stiffness: where going on would bend the picture too much in the reference's view, as a plane.
fn surface_of(
    known: &mut KnownDepth<'_>,
    stiffness: f64,
    view: &Model,
    reference: (usize, usize),
) -> Result<Option<InverseDepth>> {
    let mut completed = |extrapolation| -> Result<Option<(f64, InverseDepth)>> {
        let shape = SurfaceShape { stiffness, extrapolation, ..SurfaceShape::default() };
        let Some(map) = known.map(shape)? else { return Ok(None) };
        Ok(Some((bending(map.size(), view, Some(&map), reference)?.unwrap_or(0.0), map)))
    };
    let Some((bent, surface)) = completed(Extrapolation::Surface)? else { return Ok(None) };
    if bent > MOST_BENDING
        && let Some((less, plane)) = completed(Extrapolation::Plane)?
        && less < RELIEF * bent
    {
        return Ok(Some(plane));
    }
    Ok(Some(surface))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::Image;
    use crate::depth::OtherView;

    const SIZE: (usize, usize) = (320, 240);
    /// By how many pixels a unit of inverse depth moves.
    const ASIDE: f64 = 100.0;
    /// A post.
    const POST: LineSegment = LineSegment { start: [160.0, 20.0], end: [160.0, 220.0], width: 1.0, significance: 1.0 };

    /// How much of the post looks bent with the surface, and how many pixels of parallax its middle has, where it has 8 more than all else, and what
    /// is nearer than `reach` pixels with it.
    fn post(reach: f64) -> (f64, f64) {
        let photo = Image::new(vec![128; 4 * SIZE.0 * SIZE.1], SIZE.0, SIZE.1).unwrap();
        let model = Model { h: Matrix3::identity(), e: Vector3::new(ASIDE, 0.0, 0.0) };
        let parallax = |i: usize| {
            let [x, y] = [i % SIZE.0, i / SIZE.0].map(|v| v as f64);
            let squared = ((x - 160.0) * (x - 160.0) + (y - 120.0) * (y - 120.0)) / (reach * reach);
            2.0 + 8.0 * (-squared).exp()
        };
        let values = (0..SIZE.0 * SIZE.1).map(|i| (parallax(i) / ASIDE) as f32).collect();
        let map = InverseDepth::from_values(values, SIZE.0, SIZE.1);
        let other = OtherView::new(&model, SIZE);
        let mut known = KnownDepth::and_samples(map, Vec::new(), (photo.view(), &[]), other, &mut ()).unwrap();
        let surface = surface(&mut known, &[POST], &model, SIZE).unwrap().unwrap();
        let place = |[x, y]: [f64; 2]| model.project(x, y, surface.sample(x, y));
        (straightness(&[POST], &place, &|_| true).bent, ASIDE * surface.sample(160.0, 120.0))
    }

    #[test]
    fn a_post_stays_straight_where_little_is_misaligned_by_that() {
        let (bent, middle) = post(20.0);
        assert!(bent == 0.0 && middle < 3.0, "{bent} {middle}");
        let (bent, middle) = post(80.0);
        assert!(bent == 1.0 && middle > 9.0, "{bent} {middle}");
    }
}
