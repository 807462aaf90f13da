//! Inverse depth from two rendered photos alone, compared with the true maps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use depthstitch::InverseDepth;
use depthstitch::depth::{TwoView, derive_missing, two_view};
use depthstitch::geometry::{EstimateOptions, Frame, Model, ModelKind};
use depthstitch::report::Warning;
use scene::{MatchOptions, Pair, Photos, distance, quantile};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);
const EXACT: MatchOptions = MatchOptions { count: 400, sigma: 0.0, outliers: 0.0, seed: 1 };
const NOISY: MatchOptions = MatchOptions { count: 400, sigma: 0.3, outliers: 0.2, seed: 1 };

/// Distance between the map that a depth gives and the true one at pixels that both photos show, median and 90th percentile.
fn map_errors(model: &Model, depth: &InverseDepth, truth: &[Option<[f64; 2]>], visible: &[bool]) -> [f64; 2] {
    let errors = truth.iter().zip(visible).enumerate().filter(|(_, (_, visible))| **visible).map(|(i, (truth, _))| {
        let (x, y) = ((i % depth.width()) as f64, (i / depth.width()) as f64);
        let place = model.project(x, y, f64::from(depth.data()[i]));
        distance(place.unwrap(), truth.unwrap())
    });
    let errors: Vec<f64> = errors.collect();
    [quantile(errors.clone(), 0.5), quantile(errors, 0.9)]
}

/// As [`map_errors`], forward and reverse.
fn both_errors(found: &TwoView, pair: &Pair<'_>) -> [[f64; 2]; 2] {
    let TwoView { geometry, target, reference, .. } = found;
    [
        map_errors(&geometry.forward, target, &pair.map(), &pair.visible_in_reference()),
        map_errors(&geometry.reverse, reference, &pair.reverse_map(), &pair.visible_in_target()),
    ]
}

fn render(pair: &Pair<'_>, options: &MatchOptions, seed: u32) -> TwoView {
    let photos = Photos::of(pair, options);
    let options = EstimateOptions { seed, ..Default::default() };
    two_view(&photos.matches, photos.target.view(), photos.reference.view(), &options, &mut ()).unwrap()
}

#[test]
fn dense_depth_is_right_within_the_overlap_for_any_seed() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    for (options, seed, limits) in
        [(EXACT, 1, [0.7, 5.0]), (NOISY, 1, [1.0, 6.0]), (NOISY, 2, [1.0, 6.0]), (NOISY, 3, [1.0, 6.0])]
    {
        let found = render(&pair, &options, seed);
        assert_eq!(found.geometry.kind, ModelKind::TwoView);
        assert!(found.geometry.warnings.is_empty(), "{:?}", found.geometry.warnings);
        for [median, most] in both_errors(&found, &pair) {
            assert!(median < limits[0] && most < limits[1], "{median} {most}");
        }
        assert!(found.prediction_error.iter().all(|s| *s > 0.01 && *s < 8.0), "{:?}", found.prediction_error);
    }
    assert_eq!(render(&pair, &NOISY, 1), render(&pair, &NOISY, 1));
}

#[test]
fn flat_scene_and_pure_rotation_give_the_homography() {
    for scene in [scene::plane(), scene::rotation()] {
        let pair = scene.render(SIZE.0, SIZE.1);
        for (options, seed) in [(EXACT, 1), (NOISY, 1), (NOISY, 2), (MatchOptions { sigma: 1.0, ..NOISY }, 3)] {
            let found = render(&pair, &options, seed);
            assert_eq!(found.geometry.kind, ModelKind::Homography, "{options:?} {seed}");
            assert!(found.geometry.warnings.contains(&Warning::ParallaxUnobservable));
            assert!(!found.geometry.warnings.contains(&Warning::NoDepth));
            assert!(!found.geometry.forward.has_parallax());
            assert_eq!(found.target, InverseDepth::constant(0.0, SIZE.0, SIZE.1).unwrap());
            let [[median, _], _] = both_errors(&found, &pair);
            assert!(median < if options.sigma > 0.5 { 1.0 } else { 0.3 }, "{median}");
        }
    }
}

#[test]
fn missing_map_is_derived_from_the_other() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &NOISY);
    let maps = [photos.target_depth.as_ref(), photos.reference_depth.as_ref()];
    let options = EstimateOptions::default();
    fn frame(depth: Option<&InverseDepth>) -> Frame<'_> {
        Frame { size: SIZE, depth }
    }
    let run = |a, b| derive_missing(&photos.matches, frame(a), frame(b), &options, &mut ()).unwrap();
    assert_eq!(run(maps[0], maps[1]), None);
    assert_eq!(run(None, None), None);
    for side in [0, 1] {
        let derived = if side == 1 { run(maps[0], None) } else { run(None, maps[1]) }.unwrap();
        let given = [derived.clone(), maps[1 - side].unwrap().clone()];
        let (target, reference) = if side == 0 { (&given[0], &given[1]) } else { (&given[1], &given[0]) };
        let frames = [frame(Some(target)), frame(Some(reference))];
        let found = depthstitch::geometry::estimate(&photos.matches, frames[0], frames[1], &options, &mut ()).unwrap();
        assert_ne!(found.kind, ModelKind::Homography);
        let [median, most] = if side == 0 {
            map_errors(&found.forward, &derived, &pair.map(), &pair.visible_in_reference())
        } else {
            map_errors(&found.reverse, &derived, &pair.reverse_map(), &pair.visible_in_target())
        };
        assert!(median < 0.5 && most < 2.0, "{median} {most}");
    }
}
