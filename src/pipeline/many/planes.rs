//! Planes of the scene where stereo finds nothing: a white wall. Piecewise planar stereo (after Sinha et al., *Piecewise Planar Stereo
//! for Image-based Rendering*, 2009): the planes are those that textured places of all photos lie on, and each part of a photo gets the
//! one by which it looks alike in the others, with few changes between parts.

use super::plane_parts::{NeighbourView, PlaneDepth, Scene};
use super::views::{Views, brightness_at, textured};
use crate::depth::sample_grid;
use crate::features::Luma;
use crate::geometry::{DepthSample, MultiView, tile_planes, weighted_plane};
use crate::rect::diagonal;
use crate::statistics::median;
use crate::{ImageView, InverseDepth, Result};

/// Most planes, and samples that are looked at.
const PLANES: usize = 6;
const SAMPLES: usize = 3000;
/// Planes are started from the samples of the whole photo, and of such tiles.
const TILES: [usize; 4] = [1, 2, 4, 8];
/// Fewer samples start no plane; a plane has at least this share of all.
const FEWEST: usize = 12;
const LEAST_SHARE: f64 = 0.04;
/// Distance in the other photo, as a share of the diagonal, of what is part of a plane.
const TOLERANCE: f64 = 0.0015;
/// Refits to these, the first with twice the tolerance.
const REFITS: usize = 8;
const COARSE: usize = 3;

/// The planes of `photo`, and what is on them; `None` without any. `known` are maps of all photos that are NaN where nothing is;
/// the `other` photo sees the same.
pub(super) fn plane_depth_of(
    [photo, other]: [usize; 2],
    photos: &[ImageView<'_>],
    views: &Views,
    known: &[Option<InverseDepth>],
    geometry: &MultiView,
) -> Result<Option<PlaneDepth>> {
    let (Some(model), Some(view)) = (geometry.model([photo, other]), &views.views[photo]) else { return Ok(None) };
    let size = photos[photo].size();
    let mut samples: Vec<DepthSample> = Vec::new();
    let mut others = Vec::new();
    for (from, seen) in views.views.iter().enumerate() {
        let Some(seen) = seen else { continue };
        if let Some(map) = &known[from] {
            samples.extend(
                textured_samples([from, photo], seen, map, size, geometry).map(|(p, d)| DepthSample::new(&model, p, d)),
            );
        }
        if from != photo
            && let Some(there) = geometry.model([photo, from])
        {
            let marks = geometry.samples(photo, from);
            samples.extend(marks.iter().map(|s| DepthSample::new(&model, s.point, s.depth)));
            let ratio = |s: &DepthSample| {
                let place = there.project(s.point[0], s.point[1], s.depth)?;
                let ratio = brightness_at(view, size, s.point) / brightness_at(seen, photos[from].size(), place);
                (ratio.is_finite() && ratio > 0.0).then_some(f64::from(ratio))
            };
            if let Some(gain) = median(marks.iter().filter_map(ratio).collect()) {
                others.push(NeighbourView { model: there, view: seen, size: photos[from].size(), gain: gain as f32 });
            }
        }
    }
    let tolerance = TOLERANCE * diagonal(size);
    let Some(parallax) = median(samples.iter().map(|s| s.parallax).collect()) else { return Ok(None) };
    let planes = find(samples, size, tolerance);
    if planes.is_empty() {
        return Ok(None);
    }
    let scene = Scene { size, view, model, parallax, tolerance, others };
    scene.label(&planes, known[photo].as_ref()).map(Some)
}

/// What is known of a photo where it is textured, as another one sees it that has this size: near its frame, in front of others or
/// behind.
fn textured_samples<'a>(
    [from, to]: [usize; 2],
    view: &'a Luma,
    map: &'a InverseDepth,
    (width, height): (usize, usize),
    geometry: &MultiView,
) -> impl Iterator<Item = ([f64; 2], f64)> + use<'a> {
    let model = geometry.model([from, to]);
    let scale = view.width as f64 / map.width() as f64;
    sample_grid(map.size()).filter_map(move |(x, y)| {
        let depth = f64::from(map.data()[y * map.width() + x]);
        let place = [x, y].map(|v| (v as f64 * scale) as usize);
        if depth.is_nan() || !textured(view, place) {
            return None;
        }
        let [u, v, third] = model?.transform(x as f64, y as f64, depth);
        let [u, v] = [u / third, v / third];
        let near = |p: f64, side: usize| p > -(side as f64) && p < 2.0 * side as f64;
        (third > 0.0 && near(u, width) && near(v, height)).then_some(([u, v], depth / third))
    })
}

/// The planes that most of the samples lie on, one after another.
fn find(samples: Vec<DepthSample>, size: (usize, usize), tolerance: f64) -> Vec<[f64; 3]> {
    let step = samples.len().div_ceil(SAMPLES).max(1);
    let mut rest: Vec<DepthSample> = samples.into_iter().step_by(step).collect();
    let least = ((LEAST_SHARE * rest.len() as f64) as usize).max(2 * FEWEST);
    let mut planes = Vec::new();
    while planes.len() < PLANES && rest.len() >= least {
        let mut best: Option<([f64; 3], usize)> = None;
        for mut plane in tile_planes(&rest, size, &TILES, FEWEST) {
            for round in 0..REFITS {
                let reach = if round < COARSE { 2.0 * tolerance } else { tolerance };
                let near = rest.iter().filter(|s| s.distance(plane) < reach);
                let Some(better) = weighted_plane(near.map(|s| (s, s.parallax * s.parallax))) else { break };
                plane = better;
            }
            let members = rest.iter().filter(|s| s.distance(plane) < tolerance).count();
            if best.is_none_or(|(_, most)| members > most) {
                best = Some((plane, members));
            }
        }
        let Some((plane, _)) = best.filter(|(_, members)| *members >= least) else { break };
        rest.retain(|s| s.distance(plane) >= 2.0 * tolerance);
        planes.push(plane);
    }
    planes
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use nalgebra::{Matrix3, Vector3};

    use super::super::views::view;
    use super::*;
    use crate::Image;
    use crate::geometry::{Model, plane_depth};

    const SIZE: (usize, usize) = (320, 240);
    /// Where the wall stands on the floor; above it is a patterned board.
    const FOOT: usize = 160;
    const BOARD: usize = 140;
    /// By how many pixels a unit of inverse depth moves.
    const ASIDE: f64 = 120.0;
    /// In levels.
    const SHINE: f64 = 14.0;
    const FLOOR: [f64; 3] = [0.0, 0.004, -0.14];
    const WALL: [f64; 3] = [0.0, 0.0, 0.5];

    fn truth(y: usize) -> f64 {
        plane_depth(if y < FOOT { WALL } else { FLOOR }, [0.0, y as f64])
    }

    /// A photo from a place so far aside, from where the white wall with a few joints shines less; floor and board are patterned.
    fn photo(aside: f64) -> Image {
        let level = |i: usize| {
            let (u, y) = (i % SIZE.0, i / SIZE.0);
            let x = u as f64 - aside * truth(y);
            let cell = ((x / 7.0).floor() as i64).wrapping_mul(7919) ^ (y as i64 / 7).wrapping_mul(104729);
            let patterned = 60 + (cell.wrapping_mul(2654435761) >> 7 & 127) as u8;
            let joint = x.rem_euclid(50.0) < 2.0;
            if y >= BOARD { patterned } else { (if joint { 120.0 } else { 210.0 } - SHINE * aside / ASIDE) as u8 }
        };
        let data = (0..SIZE.0 * SIZE.1).flat_map(|i| [level(i), level(i), level(i), 255]).collect();
        Image::new(data, SIZE.0, SIZE.1).unwrap()
    }

    #[test]
    fn a_white_wall_stands_on_its_board_and_does_not_go_on_as_the_floor() {
        let views = [0.0, ASIDE].map(|aside| view(photo(aside).view()).unwrap());
        let model = Model { h: Matrix3::identity(), e: Vector3::new(ASIDE, 0.0, 0.0) };
        // Stereo finds what is patterned.
        let known = (0..SIZE.0 * SIZE.1).map(|i| if i / SIZE.0 < BOARD { f32::NAN } else { truth(i / SIZE.0) as f32 });
        let known = InverseDepth::from_values(known.collect(), SIZE.0, SIZE.1);
        let points = sample_grid(SIZE).filter(|(_, y)| *y >= BOARD);
        let samples = points.map(|(x, y)| DepthSample::new(&model, [x as f64, y as f64], truth(y))).collect();
        let tolerance = TOLERANCE * diagonal(SIZE);
        let planes = find(samples, SIZE, tolerance);
        for plane in [FLOOR, WALL] {
            let off = |found: &[f64; 3], y| (plane_depth(*found, [100.0, y]) - plane_depth(plane, [100.0, y])).abs();
            let same = |found: &[f64; 3]| off(found, 150.0) < 3e-3 && off(found, 220.0) < 3e-3;
            assert!(planes.iter().any(same), "{planes:?} lack {plane:?}");
        }
        let others = vec![NeighbourView { model, view: &views[1], size: SIZE, gain: 1.0 }];
        let scene = Scene { size: SIZE, view: &views[0], model, parallax: ASIDE, tolerance, others };
        let found = scene.label(&planes, Some(&known)).unwrap();
        let wall = sample_grid(SIZE).filter(|(_, y)| *y < BOARD).count();
        let on_wall: Vec<_> = found.samples.iter().filter(|([_, y], _)| *y < BOARD as f64).collect();
        let right = on_wall.iter().filter(|(_, depth)| (depth - WALL[2]).abs() < 5e-3).count();
        assert!(
            10 * on_wall.len() > 9 * wall && 20 * right > 19 * on_wall.len(),
            "{right} of {} of {wall}",
            on_wall.len()
        );
    }
}
