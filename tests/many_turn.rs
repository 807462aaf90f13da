//! A full turn of many photos, as people take it: by hand and with an ordinary lens.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::MultiViewKind;
use depthstitch::pipeline::many::{ManyOptions, PhotoCode, StitchedMany, stitch_many};
use depthstitch::warp::Projection;
use scene::{SIZE, Views, gallery_from, level, linear, photos, square, with_cameras};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const COUNT: usize = 12;

/// Without refined depth, which takes long and says nothing here.
fn stitched(views: &Views) -> StitchedMany {
    let mut options = ManyOptions::default();
    options.stages.refine = None;
    let done = stitch_many(&photos(views), &options, &mut ()).unwrap();
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used), "{:?}", done.photos);
    done
}

/// The turn is one cylinder, with the cameras that took the photos.
fn assert_closed(done: &StitchedMany, views: &Views) {
    println!("{:?} {:?} {} {:?}", done.geometry, done.projection, done.distortion, done.photos[0].focal);
    assert_ne!(done.geometry, MultiViewKind::Homographies);
    assert_eq!(done.projection, Projection::Cylinder);
    let focal = views.0[0].camera.k[(0, 0)];
    let found = done.photos[0].focal.unwrap();
    assert!((found / focal - 1.0).abs() < 0.04, "{found} instead of {focal}");
    for (photo, view) in done.photos.iter().zip(&views.0) {
        let turn = view.camera.r * views.0[0].camera.r.transpose();
        let own = photo.camera.unwrap().rotation * done.photos[0].camera.unwrap().rotation.transpose();
        let off = (turn * own.transpose()).trace();
        let degrees = libm::acos((0.5 * (off - 1.0)).clamp(-1.0, 1.0)).to_degrees();
        assert!(degrees < 3.0, "{degrees} degrees");
    }
}

/// Perspective, which says little of the focal length where a lens distorts, would leave the turn open.
#[test]
fn a_turn_is_closed_although_the_lens_distorts() {
    let views = square(COUNT, -0.2, SIZE);
    assert_closed(&stitched(&views), &views);
}

/// What each photo adds to the last adds up to a third; and green differs from red.
#[test]
fn light_that_does_not_close_is_put_right_everywhere() {
    let mut views = square(COUNT, 0.0, SIZE);
    for view in &mut views.0 {
        for (i, pixel) in view.rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let across = (i % SIZE.0) as f64 / SIZE.0 as f64;
            for (c, value) in pixel[..3].iter_mut().enumerate() {
                *value = level(linear(*value) * (1.0 + [0.12, 0.05, 0.1][c] * across));
            }
        }
    }
    let done = stitched(&views);
    assert_closed(&done, &views);
    let mut most: f64 = 0.0;
    for photo in 0..COUNT {
        let [one, other] = [photo, (photo + 1) % COUNT].map(|photo| done.photos[photo].gains);
        println!("{photo}: {one:?}");
        for c in 0..3 {
            most = most.max((one[c] / other[c] - 1.0).abs());
        }
    }
    assert!(most < 0.3, "neighbours differ by {most}");
}

/// The first photo was taken where the second was, and shows nothing of what the others do: of its depth nothing is known.
#[test]
fn a_photo_without_parallax_is_shown_beside_others_with_it() {
    let views = gallery_from(&[[0.0, 0.0, -0.75], [0.0, 0.0, -0.25], [0.5, 0.1, 0.3], [0.9, 0.0, 0.35]]);
    let options = ManyOptions { reference: Some(2), ..ManyOptions::default() };
    let done = stitch_many(&with_cameras(&views, &[]), &options, &mut ()).unwrap();
    assert_eq!(done.geometry, MultiViewKind::Cameras);
    assert_eq!(done.photos[0].code, PhotoCode::Used);
    let shown = done.labels.data().iter().filter(|label| **label == 1).count();
    assert!(shown * 4 > SIZE.0 * SIZE.1, "{shown} pixels");
}
