//! Many photos of which cameras or depth are known.
#![allow(clippy::unwrap_used)]

use depthstitch::InverseDepth;
use depthstitch::geometry::MultiViewKind;
use depthstitch::pipeline::many::{ManyOptions, PhotoCode, align_many, stitch_many};
use depthstitch::report::Warning;
use depthstitch::warp::Projection;
use scene::{SIZE, camera, codes, depth_map, gallery_from, landing_errors, photos, with_cameras};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

#[test]
fn known_cameras_and_depth_stay_as_they_are() {
    let views = gallery_from(&[[-0.9, 0.0, -0.1], [0.0, 0.1, 0.0], [0.9, 0.0, 0.1]]);
    let exact: Vec<InverseDepth> = views.0.iter().map(|view| depth_map(view, |d, _| d)).collect();
    let photos = with_cameras(&views, &exact);
    let mut options = ManyOptions::default();
    options.stages.output_depth = true;
    let found = align_many(&photos, &options, &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 3]);
    for (photo, view) in views.0.iter().enumerate() {
        assert_eq!(found.reports()[photo].camera, Some(camera(view)));
        assert!((found.reports()[photo].focal.unwrap() / view.camera.k[(0, 0)] - 1.0).abs() < 1e-12);
    }
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1e-3 && alone < 1e-3, "{seen} px where two photos see, {alone} px elsewhere");
    let done = stitch_many(&photos, &options, &mut ()).unwrap();
    assert_eq!(done.warnings, []);
    for (report, own) in done.photos.iter().zip(&exact) {
        assert_eq!(report.map.as_ref().unwrap().depth.as_ref(), Some(own));
    }
    // A hole is completed, and nothing else changes.
    let hole = |i: usize| (100..130).contains(&(i % SIZE.0)) && (80..110).contains(&(i / SIZE.0));
    let holes: Vec<InverseDepth> =
        views.0.iter().map(|view| depth_map(view, |d, i| if hole(i) { f32::NAN } else { d })).collect();
    let found = align_many(&with_cameras(&views, &holes), &options, &mut ()).unwrap();
    let (_, map) = found.map(0).unwrap();
    for (i, (own, truth)) in map.unwrap().data().iter().zip(exact[0].data()).enumerate() {
        assert!(if hole(i) { own.is_finite() } else { own == truth }, "pixel {i}: {own}, {truth}");
    }
}

#[test]
fn cameras_alone_make_depth_and_depth_alone_is_brought_to_the_cameras_found() {
    let views = gallery_from(&[[-0.45, 0.1, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    let options = ManyOptions::default();
    let found = align_many(&with_cameras(&views, &[]), &options, &mut ()).unwrap();
    assert_eq!(found.reports()[1].camera, Some(camera(&views.0[1])));
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "cameras: {seen} px where two photos see, {alone} px elsewhere");

    let relative: Vec<InverseDepth> = views.0.iter().map(|view| depth_map(view, |d, _| 3.0 * d + 0.25)).collect();
    let mut given = photos(&views);
    given.iter_mut().zip(&relative).for_each(|(photo, depth)| photo.depth = Some(depth));
    let found = align_many(&given, &options, &mut ()).unwrap();
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.0 && alone < 1.5, "depth: {seen} px where two photos see, {alone} px elsewhere");

    // Near is far: this explains nothing.
    let wrong: Vec<InverseDepth> = views.0.iter().map(|view| depth_map(view, |d, _| 1.0 / (d + 0.05))).collect();
    given.iter_mut().zip(&wrong).for_each(|(photo, depth)| photo.depth = Some(depth));
    let done = stitch_many(&given, &options, &mut ()).unwrap();
    assert_eq!(done.warnings, [Warning::DepthInconsistent]);
}

/// Cameras in one place, which is not the origin: their places are the same up to rounding.
#[test]
fn known_cameras_that_only_turned_have_no_parallax() {
    let views = gallery_from(&[[0.3, 0.2, -0.3], [0.3, 0.2, 0.0], [0.3, 0.2, 0.3]]);
    assert!(camera(&views.0[0]).translation.norm() > 0.1);
    let done = stitch_many(&with_cameras(&views, &[]), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(done.geometry, MultiViewKind::Rotations);
}

/// By the near wall, which most of the last photo shows, nothing would be stretched on the plane: but the house would.
#[test]
fn what_is_far_behind_the_rest_is_not_stretched() {
    let shown = |turn: f64, projection| {
        let views = scene::court(2.0, turn, SIZE);
        let depths: Vec<_> = views.0.iter().map(|view| depth_map(view, |d, _| d)).collect();
        let mut options = ManyOptions { reference: Some(0), ..ManyOptions::default() };
        options.stages.projection = projection;
        let done = stitch_many(&with_cameras(&views, &depths), &options, &mut ()).unwrap();
        assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
        (done.projection, done.image.width())
    };
    let (plane, wide) = shown(0.75, Some(Projection::Plane));
    let (around, narrow) = shown(0.75, None);
    assert_eq!([plane, around], [Projection::Plane, Projection::Cylinder]);
    assert!(3 * narrow < 2 * wide, "{narrow} and {wide} pixels wide");
    assert_eq!(shown(0.5, None).0, Projection::Plane);
}
