//! Points tracked over the overlap, against the truth of a rendered scene, and what they add to the geometry.
#![allow(clippy::unwrap_used)]

use depthstitch::features::track;
use depthstitch::geometry::{Calibration, EstimateOptions, Frame, Match, Model, estimate};
use depthstitch::pipeline::{Options, align};
use depthstitch::{Error, Image, InverseDepth};
use scene::{MatchOptions, Pair, Photos, distance, map_error};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (320, 212);
/// Few, and hardly as good as a detector's.
const POOR: MatchOptions = MatchOptions { count: 40, sigma: 0.5, outliers: 0.1, seed: 1 };

fn tracked(photos: &Photos, reverse: &Model) -> Vec<Match> {
    let mut matches = Vec::new();
    let depth = photos.reference_depth.as_ref().unwrap();
    track(photos.target.view(), photos.reference.view(), depth, reverse, &mut matches, &mut ()).unwrap();
    matches
}

/// The true reverse model, off by (0.9, −0.7) pixels.
fn shifted(pair: &Pair<'_>) -> Model {
    let mut model = pair.reverse;
    let (third, e) = (model.h.row(2).into_owned(), model.e[2]);
    for (row, by) in [(0, 0.9), (1, -0.7)] {
        model.h.row_mut(row).zip_apply(&third, |own, third| *own += by * third);
        model.e[row] += by * e;
    }
    model
}

/// How far matches are from the truth, in pixels of the reference, ascending.
fn errors(matches: &[Match], pair: &Pair<'_>) -> Vec<f64> {
    let error = |m: &Match| {
        let [x, y] = m.target;
        let depth = pair.target.depth[(y + 0.5) as usize * SIZE.0 + (x + 0.5) as usize];
        pair.forward.project(x, y, 1.0 / depth).map_or(f64::INFINITY, |place| distance(place, m.reference))
    };
    let mut errors: Vec<f64> = matches.iter().map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn points_are_tracked_to_where_they_are() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let mut photos = Photos::of(&pair, &POOR);
    // Exposure is no matter.
    for gain in [1.0, 0.8] {
        photos.target.data_mut().iter_mut().for_each(|v| *v = (gain * f64::from(*v) + 20.0 * (1.0 - gain)) as u8);
        let matches = tracked(&photos, &shifted(&pair));
        let errors = errors(&matches, &pair);
        let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 9 / 10]);
        assert!(matches.len() > 150, "{} points", matches.len());
        assert!(median < 0.12 && most < 0.4, "{} points: median {median} px, 90 % {most} px", matches.len());
    }
}

#[test]
fn nothing_is_tracked_without_texture_or_depth() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &POOR);
    let gray = Image::new(vec![128; 4 * SIZE.0 * SIZE.1], SIZE.0, SIZE.1).unwrap();
    let flat = Photos { target: gray.clone(), reference: gray, ..photos.clone() };
    assert_eq!(tracked(&flat, &pair.reverse), []);
    let unknown = InverseDepth::constant(f32::NAN, SIZE.0, SIZE.1).unwrap();
    assert_eq!(tracked(&Photos { reference_depth: Some(unknown), ..photos.clone() }, &pair.reverse), []);
    for tiny in [(1, 1), (14, 40)] {
        let image = Image::new(vec![90; 4 * tiny.0 * tiny.1], tiny.0, tiny.1).unwrap();
        let depth = InverseDepth::constant(1.0, tiny.0, tiny.1).unwrap();
        let mut matches = Vec::new();
        track(image.view(), image.view(), &depth, &pair.reverse, &mut matches, &mut ()).unwrap();
        assert_eq!(matches, []);
        let error = track(image.view(), photos.reference.view(), &depth, &pair.reverse, &mut matches, &mut ());
        assert!(matches!(*error.unwrap_err(), Error::WrongSize { name: "referenceDepth", .. }));
    }
}

#[test]
fn exact_depth_ties_the_cameras_all_over_the_overlap() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &POOR);
    let options = EstimateOptions { calibration: Calibration::Always, ..Default::default() };
    let (mut by_matches, mut by_both) = (Vec::new(), Vec::new());
    for seed in 1..=5 {
        let matches = pair.matches(&MatchOptions { seed, ..POOR }).matches;
        let (target, reference) = (photos.target(), photos.reference());
        let frames = [target, reference].map(|view| Frame { size: SIZE, depth: view.depth });
        let alone = estimate(&matches, frames[0], frames[1], &options, &mut ()).unwrap();
        let all = Options { estimate: options.clone(), refine: None, ..Options::default() };
        let aligned = align(Some(&matches), target, reference, &all, &mut ()).unwrap();
        assert_eq!(aligned.geometry.inliers.len(), matches.len());
        by_matches.push(map_error(&alone.forward, &pair)[1]);
        by_both.push(map_error(&aligned.geometry.forward, &pair)[1]);
    }
    let [worst, alone] = [&by_both, &by_matches].map(|errors| errors.iter().copied().fold(0.0, f64::max));
    assert!(worst < 0.3 && 4.0 * worst < alone, "{by_both:?} px against {by_matches:?} px");
}
