//! Maps that agree with matches and yet turn most of the target behind the reference's camera.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::{Match, Model};
use depthstitch::pipeline::{Options, align, stitch};
use depthstitch::{Image, View};
use nalgebra::Matrix3;
use scene::Random;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (120, 80);

/// What is to the right of x = 50 is behind the camera: 58 %.
fn turning() -> Model {
    Model::homography(Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.02, 0.0, 1.0))
}

fn shifting() -> Model {
    Model::homography(Matrix3::new(1.0, 0.0, -60.0, 0.0, 1.0, 5.0, 0.0, 0.0, 1.0))
}

/// So many matches of a map, the target's points from `left` on to 25 pixels farther right.
fn matches(map: &Model, count: usize, left: f64, random: &mut Random) -> Vec<Match> {
    let place = |random: &mut Random| {
        let target = [left + 25.0 * random.uniform(), 38.0 * random.uniform()];
        let [x, y] = map.project(target[0], target[1], 0.0).unwrap();
        let [dx, dy] = [0.3 * random.normal(), 0.3 * random.normal()];
        Match { target, reference: [(x + dx).abs(), (y + dy).abs()] }
    };
    (0..count).map(|_| place(random)).collect()
}

fn photo() -> Image {
    Image::new(vec![128; 4 * SIZE.0 * SIZE.1], SIZE.0, SIZE.1).unwrap()
}

#[test]
fn most_of_the_target_behind_the_camera_is_an_error_that_says_how_much() {
    let photo = photo();
    let view = View { image: photo.view(), depth: None };
    let matches = matches(&turning(), 60, 0.0, &mut Random::new(1));
    let error = stitch(Some(&matches), view, view, &Options::default(), &mut ()).unwrap_err();
    assert_eq!(error.code(), "degenerate-geometry");
    let details = error.details();
    let behind = details.iter().find(|(name, _)| *name == "behind").unwrap().1;
    assert!((behind - 0.58).abs() < 0.06, "{behind}");
    assert!(error.to_string().contains('%'), "{error}");
}

#[test]
fn another_map_is_found_that_explains_the_matches_as_well() {
    let photo = photo();
    let view = View { image: photo.view(), depth: None };
    let mut turned = 0;
    for seed in 1..=12 {
        let mut random = Random::new(u64::from(seed));
        let mut all = matches(&turning(), 12, 0.0, &mut random);
        all.extend(matches(&shifting(), 12, 70.0, &mut random));
        let mut options = Options::default();
        options.estimate.seed = seed;
        // Which of them is found is luck.
        options.estimate.max_trials = 40;
        let Ok(found) = align(Some(&all), view, view, &options, &mut ()) else {
            turned += 1;
            continue;
        };
        let [_, _, third] = found.geometry.forward.transform(60.0, 40.0, 0.0);
        assert!(third > 0.0, "seed {seed}: the middle is behind the camera");
    }
    assert!(turned < 3, "{turned} of 12 are refused");
}
