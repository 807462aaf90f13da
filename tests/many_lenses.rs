//! Photos of one scene by several lenses, of which nothing is known, or of some.
#![allow(clippy::unwrap_used)]

use depthstitch::pipeline::many::{ManyAlignment, ManyOptions, align_many};
use nalgebra::Vector3;
use scene::{Pose, SIZE, Views, codes, landing_errors, photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const AROUND: [[f64; 3]; 5] =
    [[-0.4, 0.0, -0.1], [-0.4, 0.5, -0.05], [0.1, 0.5, 0.05], [0.4, 0.3, 0.1], [0.1, 0.0, 0.0]];
const TURNING: [[f64; 3]; 4] = [[0.0, 0.0, -0.3], [0.0, 0.0, -0.1], [0.0, 0.0, 0.1], [0.0, 0.0, 0.3]];

/// The gallery from (x, z) in metres, turned by an angle to the right, each photo zoomed in by a factor.
fn zoomed<const N: usize>(places: [[f64; 3]; N], zooms: [f64; N]) -> Views {
    let scene = scene::gallery();
    let first = scene.target;
    let pose = |i: usize| {
        let [x, z, yaw] = places[i];
        Pose { centre: first.centre + Vector3::new(x, 0.0, z), yaw, focal: first.focal * zooms[i], ..first }
    };
    scene.views(&std::array::from_fn::<_, N, _>(pose), SIZE.0, SIZE.1)
}

/// The largest error of the focal lengths, as a share of them.
fn focal_error(found: &ManyAlignment, views: &Views) -> f64 {
    let ratio = |(photo, view): (usize, &scene::View)| found.reports()[photo].focal.unwrap() / view.camera.k[(0, 0)];
    views.0.iter().enumerate().map(|photo| (ratio(photo) - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn zoomed_photos_have_focal_lengths_of_their_own() {
    let views = zoomed(AROUND, [1.0, 1.5, 1.0, 1.25, 1.0]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 5]);
    let error = focal_error(&found, &views);
    assert!(error < 0.04, "focal lengths are {error} off");
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 5.0, "{seen} px where two photos see, {alone} px elsewhere");
}

#[test]
fn a_turning_camera_may_zoom() {
    let views = zoomed(TURNING, [1.0, 1.4, 1.0, 1.2]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let error = focal_error(&found, &views);
    assert!(error < 0.04, "focal lengths are {error} off");
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "{seen} px where two photos see, {alone} px elsewhere");
}

/// What is known stays as it is, relatively; the photo without metadata is found to be zoomed.
#[test]
fn one_focal_length_of_several_is_unknown() {
    let views = zoomed(AROUND, [1.0, 1.5, 1.0, 1.0, 1.2]);
    let mut photos = photos(&views);
    for photo in [0, 2, 3, 4] {
        photos[photo].focal = Some(views.0[photo].camera.k[(0, 0)]);
    }
    let found = align_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 5]);
    let focal = |photo: usize| found.reports()[photo].focal.unwrap();
    assert!((focal(4) / focal(0) - 1.2).abs() < 1e-9);
    let error = focal_error(&found, &views);
    assert!(error < 0.03, "focal lengths are {error} off");
}

/// A camera that comes closer shows things larger, by the same lens.
#[test]
fn photos_by_one_lens_have_one_focal_length() {
    let views = zoomed([[-0.3, 0.0, 0.0], [0.0, 1.2, 0.0], [0.3, 0.3, 0.0]], [1.0; 3]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 3]);
    let [first, second, third] = [0, 1, 2].map(|photo| found.reports()[photo].focal.unwrap());
    assert!(first == second && second == third, "{first}, {second}, {third}");
}
