//! Stitching many photos: what is refused, what is reported, and stopping.
#![allow(clippy::unwrap_used, clippy::panic)]

use depthstitch::geometry::Camera;
use depthstitch::observer::Observer;
use depthstitch::pipeline::many::{ManyOptions, Photo, align_many, stitch_many};
use depthstitch::{Error, ImageView, InverseDepth, Stage};
use nalgebra::{Matrix3, Vector3};
use scene::{gallery_from, photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// What is wrong with the second photo.
fn of_second(error: Error) -> Error {
    match error {
        Error::OfPhoto { index: 1, error } => *error,
        error => panic!("{error}"),
    }
}

#[test]
fn cameras_are_checked() {
    let pixels = vec![128; 4 * 32 * 24];
    let own = Camera { rotation: Matrix3::identity(), translation: Vector3::zeros() };
    let photo = Photo::new(ImageView::new("photo", &pixels, 32, 24).unwrap());
    let known = Photo { focal: Some(30.0), camera: Some(own), ..photo };
    let refused = |photos: &[Photo<'_>]| *stitch_many(photos, &ManyOptions::default(), &mut Never).unwrap_err();
    let name = |error: Error| match of_second(error) {
        Error::InvalidArgument { name, .. } | Error::Missing { name, .. } => name,
        error => panic!("{error}"),
    };
    let error = refused(&[known, photo]);
    assert!(matches!(error, Error::InvalidArgument { name: "camera", value: 1.0, .. }), "{error}");
    assert_eq!(name(refused(&[known, Photo { focal: None, ..known }])), "focalLength");
    let mut one_nan = Matrix3::identity();
    one_nan[(0, 0)] = f64::NAN;
    for rotation in [Matrix3::identity() * 1.1, -Matrix3::identity(), Matrix3::from_element(f64::NAN), one_nan] {
        assert_eq!(name(refused(&[known, Photo { camera: Some(Camera { rotation, ..own }), ..known }])), "rotation");
    }
    let translation = Vector3::new(0.0, f64::INFINITY, 0.0);
    assert_eq!(name(refused(&[known, Photo { camera: Some(Camera { translation, ..own }), ..known }])), "translation");
    let small = InverseDepth::constant(1.0, 16, 12).unwrap();
    let error = of_second(refused(&[photo, Photo { depth: Some(&small), ..photo }]));
    assert!(matches!(error, Error::WrongSize { name: "depth", .. }), "{error}");
}

#[test]
fn arguments_are_checked_before_anything_is_done() {
    let pixels = vec![128; 4 * 32 * 24];
    let photo = Photo::new(ImageView::new("photo", &pixels, 32, 24).unwrap());
    let refused = |photos: &[Photo<'_>], options: &ManyOptions| {
        let error = *stitch_many(photos, options, &mut Never).unwrap_err();
        assert_eq!(align_many(photos, options, &mut Never).unwrap_err().code(), error.code());
        error
    };
    let defaults = ManyOptions::default();
    for count in [0, 1, 31] {
        let error = refused(&vec![photo; count], &defaults);
        let Error::InvalidArgument { name: "photos", value, .. } = error else { panic!("{error}") };
        assert_eq!(value, count as f64);
    }
    let error = refused(&[photo; 3], &ManyOptions { reference: Some(3), ..defaults.clone() });
    assert!(matches!(error, Error::InvalidArgument { name: "reference", value: 3.0, .. }), "{error}");
    for focal in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = of_second(refused(&[photo, Photo { focal: Some(focal), ..photo }], &defaults));
        assert!(matches!(error, Error::InvalidArgument { name: "focalLength", .. }), "{error}");
    }
    let mut bands = defaults.clone();
    bands.stages.blend.bands = 64;
    let error = refused(&[photo; 3], &bands);
    assert!(matches!(error, Error::InvalidArgument { name: "bands", value: 64.0, .. }), "{error}");
    let mut small = defaults.clone();
    small.stages.warp.max_bytes = 100_000;
    assert_eq!(refused(&[photo; 3], &small).code(), "too-large");
    // Nothing to match.
    assert_eq!(stitch_many(&[photo; 3], &defaults, &mut ()).unwrap_err().code(), "no-consensus");
}

/// Must not be asked.
struct Never;

impl Observer for Never {
    fn progress(&mut self, stage: Stage, _: f32) -> bool {
        panic!("{stage:?} has begun")
    }
}

/// Stops at the n-th report, and remembers what was reported.
struct Stop {
    left: usize,
    seen: Vec<Stage>,
}

impl Observer for Stop {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        assert!((0.0..=1.0).contains(&fraction), "{stage:?} {fraction}");
        if !self.seen.contains(&stage) {
            self.seen.push(stage);
        }
        self.left -= 1;
        self.left > 0
    }
}

#[test]
fn every_stage_reports_and_can_be_stopped() {
    let views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let photos = photos(&views);
    let mut all = Stop { left: usize::MAX, seen: Vec::new() };
    stitch_many(&photos, &ManyOptions::default(), &mut all).unwrap();
    for stage in [Stage::Detect, Stage::Match, Stage::Estimate, Stage::Depth, Stage::Warp, Stage::Blend, Stage::Fill] {
        assert!(all.seen.contains(&stage), "{stage:?}");
    }
    let reports = usize::MAX - all.left;
    for share in [0, 3, 6, 9] {
        let mut stop = Stop { left: 1 + share * reports / 10, seen: Vec::new() };
        assert_eq!(stitch_many(&photos, &ManyOptions::default(), &mut stop).unwrap_err().code(), "aborted", "{share}");
    }
}
