//! A camera that turned so far that the photos share a narrow strip: what lies beyond goes where it belongs.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::{Match, Model, ModelKind};
use depthstitch::pipeline::{Options, align};
use depthstitch::{Image, View};
use nalgebra::{Matrix3, Rotation3, Vector3};
use scene::Random;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (400, 300);
const FOCAL: f64 = 350.0;

/// Turned to the left by 54° of the 60° that a photo shows.
fn turn() -> Model {
    let k = Matrix3::new(FOCAL, 0.0, 199.5, 0.0, FOCAL, 149.5, 0.0, 0.0, 1.0);
    let rotation = Rotation3::from_euler_angles(0.03, -0.94, 0.02);
    Model::homography(k * rotation.matrix() * k.try_inverse().unwrap())
}

/// Matches in the strip that both photos show, each off by about a pixel.
fn matches(turn: &Model, random: &mut Random) -> Vec<Match> {
    let mut found = Vec::new();
    while found.len() < 25 {
        let target = [400.0 * random.uniform(), 300.0 * random.uniform()];
        let Some(place) = turn.project(target[0], target[1], 0.0) else { continue };
        let [x, y] = place.map(|p| p + 1.5 * random.normal());
        if (0.0..399.0).contains(&x) && (0.0..299.0).contains(&y) {
            found.push(Match { target, reference: [x, y] });
        }
    }
    found
}

/// The largest angle between where the target's corners belong, as seen by the reference's camera, and where a map takes them.
fn largest_angle(turn: &Model, found: &Model) -> f64 {
    let ray = |model: &Model, [x, y]: [f64; 2]| {
        let [u, v, w] = model.transform(x, y, 0.0);
        Vector3::new(u - 199.5 * w, v - 149.5 * w, FOCAL * w)
    };
    let corners = [[0.0, 0.0], [399.0, 0.0], [0.0, 299.0], [399.0, 299.0]];
    corners.map(|corner| ray(turn, corner).angle(&ray(found, corner))).into_iter().fold(0.0, f64::max).to_degrees()
}

#[test]
fn what_lies_far_beyond_a_narrow_overlap_is_where_the_camera_turned_to() {
    let photo = Image::new(vec![128; 4 * SIZE.0 * SIZE.1], SIZE.0, SIZE.1).unwrap();
    let view = View { image: photo.view(), depth: None };
    let truth = turn();
    let mut mended = 0;
    for seed in 1..=10 {
        let matches = matches(&truth, &mut Random::new(seed));
        let mut options = Options::default();
        options.estimate.focal = Some(FOCAL);
        let plain = Options { refine: None, ..options.clone() };
        // What explains the matches best, and what was chosen by its looks as well.
        let [plain, chosen] = [&plain, &options].map(|options| {
            let found = align(Some(&matches), view, view, options, &mut ()).unwrap().geometry;
            assert_eq!(found.kind, ModelKind::Homography);
            largest_angle(&truth, &found.forward)
        });
        println!("{seed}: {plain:.1}° {chosen:.1}°");
        assert!(chosen <= plain, "{seed}: {chosen}° instead of {plain}°");
        mended += usize::from(plain > 15.0 && chosen < 1.0);
    }
    assert!(mended >= 2, "{mended} of 10");
}
