//! Many photos of rendered scenes, of which everything is known.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::{Camera, MultiViewKind};
use depthstitch::pipeline::many::{ManyAlignment, ManyOptions, Photo, PhotoCode, align_many, stitch_many};
use depthstitch::warp::Projection;
use depthstitch::{Image, ImageView};
use nalgebra::{Matrix3, Vector3};
use scene::{Pose, SIZE, Views, codes, gallery_from, landing_errors, median, photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// The angle between rotations, in degrees.
fn angle(r: &Matrix3<f64>) -> f64 {
    libm::acos(((r.trace() - 1.0) / 2.0).clamp(-1.0, 1.0)).to_degrees()
}

/// The largest errors of all pairs: of the rotation and of the direction of the translation, in degrees.
fn camera_errors(found: &ManyAlignment, views: &Views) -> [f64; 2] {
    let cameras: Vec<Camera> = found.reports().iter().filter_map(|report| report.camera).collect();
    assert_eq!(cameras.len(), views.0.len());
    let mut worst = [0.0f64; 2];
    for (a, from) in cameras.iter().enumerate() {
        for (b, to) in cameras.iter().enumerate().skip(a + 1) {
            let turn = to.rotation * from.rotation.transpose();
            let [one, other] = [&views.0[a].camera, &views.0[b].camera];
            worst[0] = worst[0].max(angle(&(turn * (other.r * one.r.transpose()).transpose())));
            let moved = (to.translation - turn * from.translation).normalize();
            let truth = (other.r * (one.centre - other.centre)).normalize();
            worst[1] = worst[1].max(libm::acos(moved.dot(&truth).clamp(-1.0, 1.0)).to_degrees());
        }
    }
    worst
}

#[test]
fn strip_of_four_photos_is_one_picture() {
    let views = gallery_from(&[[-0.9, 0.0, -0.1], [-0.45, 0.1, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    let photos = photos(&views);
    let found = align_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let [rotation, translation] = camera_errors(&found, &views);
    assert!(rotation < 0.6 && translation < 3.0, "{rotation}° of rotation, {translation}° of translation");
    let (focal, truth) = (found.reports()[0].focal.unwrap(), views.0[0].camera.k[(0, 0)]);
    assert!((focal / truth - 1.0).abs() < 0.03, "{focal} instead of {truth}");
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "{seen} px where two photos see, {alone} px elsewhere");
    // The order of the photos makes no difference to that.
    let shuffled = [2, 0, 3, 1].map(|i| photos[i]);
    let again = align_many(&shuffled, &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&again), ["used"; 4]);

    let done = stitch_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(done.geometry, MultiViewKind::Cameras);
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
    // What one of the inner photos shows others show as well, and seams may leave nothing of it.
    for photo in [0, 3, done.reference] {
        assert!(done.labels.data().contains(&(photo as u8 + 1)), "photo {photo} does not show");
    }
    // The reference is where it should be, and nearly as it was.
    let (left, top) = done.offset;
    let reference = &photos[done.reference].image;
    let mut differing = 0;
    for (i, pixel) in reference.pixels().iter().enumerate() {
        let at = (top + i / SIZE.0) * done.image.width() + left + i % SIZE.0;
        let own = done.labels.data()[at] == done.reference as u8 + 1;
        differing += usize::from(own && (0..3).any(|c| pixel[c].abs_diff(done.image.pixels()[at][c]) > 24));
    }
    assert!(differing < SIZE.0 * SIZE.1 / 50, "{differing} pixels of the reference differ");
    // Every pixel has a photo, but for voids that were filled.
    for ((pixel, label), void) in done.image.pixels().iter().zip(done.labels.data()).zip(done.voids.data()) {
        assert!(*label <= 4 && (pixel[3] != 0 || *label == 0) && (*label == 0 || *void == 0));
    }
}

#[test]
fn turning_camera_needs_no_depth() {
    let views = gallery_from(&[[0.0, 0.0, -0.5], [0.0, 0.0, -0.25], [0.0, 0.0, 0.0], [0.0, 0.0, 0.25]]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "{seen} px where two photos see, {alone} px elsewhere");
}

/// Around by more than a plane could show, the camera held at an angle to the horizon.
#[test]
fn wide_view_is_shown_around_the_viewer_with_a_level_horizon() {
    let scene = scene::gallery();
    let pose = |yaw: f64| Pose { yaw, pitch: 0.12, focal: 0.9, ..scene.target };
    let yaws = [0.75, -0.25, 0.25, -0.75];
    let views = scene.views(&yaws.map(pose), SIZE.0, SIZE.1);
    let photos = photos(&views);
    let stitched = |projection| {
        let mut options = ManyOptions::default();
        options.stages.projection = projection;
        stitch_many(&photos, &options, &mut ()).unwrap()
    };
    let done = stitched(None);
    assert_eq!(done.projection, Projection::Cylinder);
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
    for done in [done, stitched(Some(Projection::Sphere))] {
        // Where a pixel belongs if the horizon is level, but for where the picture begins.
        let focal = done.photos[0].focal.unwrap();
        let place = |photo: usize, x: f64, y: f64| {
            let ray = views.0[photo].camera.direction(x, y);
            let across = libm::sqrt(ray.x * ray.x + ray.z * ray.z);
            let cylinder = done.projection == Projection::Cylinder;
            let down = if cylinder { ray.y / across } else { libm::atan2(ray.y, across) };
            [focal * libm::atan2(ray.x, ray.z), focal * down]
        };
        let (w, h) = (SIZE.0 as f64 - 1.0, SIZE.1 as f64 - 1.0);
        let border = (0..=100).flat_map(|i| {
            let (x, y) = (w * f64::from(i) / 100.0, h * f64::from(i) / 100.0);
            [[x, 0.0], [x, h], [0.0, y], [w, y]].map(|[x, y]| place(done.reference, x, y))
        });
        let first = border.fold([f64::MAX; 2], |[x, y], [u, v]| [x.min(u), y.min(v)]);
        // How much colours differ at the median, were they this far below.
        let differing = |below: i64| {
            let mut errors = Vec::new();
            for (i, photo) in photos.iter().enumerate() {
                for (x, y) in (8..SIZE.1 - 8).step_by(9).flat_map(|y| (8..SIZE.0 - 8).step_by(9).map(move |x| (x, y))) {
                    let [u, v] = place(i, x as f64, y as f64);
                    let (u, v) = ((u - first[0]).round() as i64, (v - first[1]).round() as i64 + below);
                    let (u, v) = (u + done.offset.0 as i64, v + done.offset.1 as i64);
                    let at = v as usize * done.image.width() + u as usize;
                    if done.labels.data().get(at) == Some(&(i as u8 + 1)) {
                        let [own, other] = [photo.image.pixel(x, y), done.image.pixels()[at]];
                        errors.push((0..3).map(|c| f64::from(own[c].abs_diff(other[c]))).sum::<f64>() / 3.0);
                    }
                }
            }
            assert!(errors.len() > 1500, "{} pixels", errors.len());
            median(errors)
        };
        // Texture is fine: a few pixels away it is another.
        let (here, there) = (differing(0), differing(12));
        assert!(here < 0.6 * there, "{:?}: colours differ by {here} levels, elsewhere by {there}", done.projection);
    }
    // A plane has no room for all of it, or stretches it; but the reference stays as it is.
    let done = stitched(Some(Projection::Plane));
    let reference = &photos[done.reference].image;
    let extent = done.photos[done.reference].extent.unwrap();
    assert_eq!(extent, [0, 0, reference.width() as i64, reference.height() as i64]);
}

/// A quarter of a turn clockwise.
fn turned(photo: ImageView<'_>) -> Image {
    let (w, h) = photo.size();
    let pixel = |i: usize| photo.pixels()[(h - 1 - i % h) * w + i / h];
    Image::new((0..w * h).flat_map(pixel).collect(), h, w).unwrap()
}

/// Photos taken on their side: the axis of cylinder and sphere is level, and the picture the same but for that.
#[test]
fn photos_on_their_side_make_a_picture_on_its_side() {
    let scene = scene::gallery();
    let pose = |yaw: f64| Pose { yaw, focal: 0.9, ..scene.target };
    let views = scene.views(&[0.75, -0.25, 0.25, -0.75].map(pose), SIZE.0, SIZE.1);
    let upright = photos(&views);
    let images: Vec<Image> = upright.iter().map(|photo| turned(photo.image)).collect();
    let on_their_side: Vec<Photo<'_>> = images.iter().map(|image| Photo::new(image.view())).collect();
    for projection in [None, Some(Projection::Sphere)] {
        let mut options = ManyOptions::default();
        options.stages.projection = projection;
        let [expected, found] =
            [&upright, &on_their_side].map(|photos| stitch_many(photos, &options, &mut ()).unwrap());
        assert_eq!((found.projection, found.reference), (expected.projection, expected.reference));
        let ((w, h), size) = (expected.image.size(), found.image.size());
        let near = |a: usize, b: usize| a.abs_diff(b) * 50 < b;
        assert!(near(size.0, h) && near(size.1, w), "{projection:?}: {size:?} instead of {h} × {w}");
        // Nothing of it is elsewhere: colours at the median, and those some pixels beside.
        let turned = turned(expected.image.view());
        let differing = |beside: usize| {
            let mut errors = Vec::new();
            for (y, x) in
                (20..w.min(size.1) - 20).step_by(5).flat_map(|y| (20..h.min(size.0) - 20).map(move |x| (y, x)))
            {
                let [a, b] = [turned.pixels()[y * h + x], found.image.pixels()[y * size.0 + x + beside]];
                if a[3] != 0 && b[3] != 0 {
                    errors.push((0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0);
                }
            }
            median(errors)
        };
        let (here, there) = (differing(0), differing(12));
        assert!(here < 0.6 * there, "{projection:?}: colours differ by {here} levels, elsewhere by {there}");
    }
}

#[test]
fn flat_scene_is_one_picture() {
    let scene = scene::plane();
    let first = scene.target;
    let pose = |x: f64, yaw: f64| Pose { centre: first.centre + Vector3::new(x, 0.0, 0.1 * x), yaw, ..first };
    let views = scene.views(&[pose(-1.0, -0.1), pose(0.0, 0.0), pose(1.0, 0.1), pose(2.0, 0.0)], SIZE.0, SIZE.1);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.0 && alone < 2.0, "{seen} px where two photos see, {alone} px elsewhere");
}

/// Seven photos of a wall, one beside the other: the outer ones are more than twice their width away from the middle.
#[test]
fn a_long_row_of_photos_that_overlap_by_little_is_shown_whole() {
    let scene = scene::plane();
    let first = scene.target;
    let pose =
        |i: usize| Pose { centre: first.centre + Vector3::new(4.6 * (i as f64 - 3.0), 0.0, 0.0), yaw: 0.0, ..first };
    let views = scene.views(&[0, 1, 2, 3, 4, 5, 6].map(pose), SIZE.0, SIZE.1);
    let done = stitch_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert!(done.warnings.is_empty(), "{:?}", done.warnings);
    for (photo, report) in done.photos.iter().enumerate() {
        let [x, y, width, height] = report.extent.unwrap();
        let [left, top] = views.place([photo, done.reference], [0, 0]).unwrap();
        let [right, bottom] = views.place([photo, done.reference], [SIZE.0 - 1, SIZE.1 - 1]).unwrap();
        let truth = [left, top, right - left + 1.0, bottom - top + 1.0];
        for (found, truth) in [x, y, width, height].into_iter().zip(truth) {
            assert!((found as f64 - truth).abs() < 12.0, "photo {photo}: {:?} instead of {truth:?}", report.extent);
        }
    }
}

/// Around a square and back: the last photo overlaps the first.
#[test]
fn loop_closes() {
    let views =
        gallery_from(&[[-0.4, 0.0, -0.1], [-0.4, 0.5, -0.05], [0.1, 0.5, 0.05], [0.4, 0.3, 0.1], [0.1, 0.0, 0.0]]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 5]);
    let [rotation, translation] = camera_errors(&found, &views);
    assert!(rotation < 0.6 && translation < 5.0, "{rotation}° of rotation, {translation}° of translation");
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "{seen} px where two photos see, {alone} px elsewhere");
}

#[test]
fn photo_of_something_else_is_left_out() {
    let mut views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let wall = scene::plane();
    views.0.insert(1, wall.views(&[wall.target], SIZE.0, SIZE.1).0.remove(0));
    let photos = photos(&views);
    let done = stitch_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    let codes: Vec<_> = done.photos.iter().map(|photo| photo.code.code()).collect();
    assert_eq!(codes, ["used", "no-matches", "used", "used"]);
    assert!(!done.labels.data().contains(&2) && done.photos[1].extent.is_none());
    assert!(done.pairs.iter().filter(|pair| pair.photos.contains(&1)).all(|pair| !pair.linked));
    // It shows nothing of the others, so it cannot be what all are to be seen from.
    let options = ManyOptions { reference: Some(1), ..ManyOptions::default() };
    assert_eq!(stitch_many(&photos, &options, &mut ()).unwrap_err().code(), "no-consensus");
}

/// As many photos as there may be, in three rows, most of which overlap others than those next to them.
#[test]
fn thirty_photos_are_one_picture() {
    let views = scene::walk(30, 160, 107);
    let photos = photos(&views);
    let done = stitch_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
    // Of each photo's best eight.
    assert!(done.pairs.len() <= 8 * 30, "{} pairs", done.pairs.len());
    let errors: Vec<f64> = done.photos.iter().filter_map(|photo| photo.error).collect();
    assert!(median(errors.clone()) < 0.5, "{errors:?}");
}

#[test]
fn groups_apart_are_told() {
    let mut views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let wall = scene::plane();
    views.0.extend(wall.views(&[wall.target, wall.reference], SIZE.0, SIZE.1).0);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used", "used", "used", "other-group", "other-group"]);
    let options = ManyOptions { reference: Some(4), ..ManyOptions::default() };
    let found = align_many(&photos(&views), &options, &mut ()).unwrap();
    assert_eq!(codes(&found), ["other-group", "other-group", "other-group", "used", "used"]);
    assert_eq!(found.reference, 4);
}

/// What the first one shows beside the way would be enlarged in the view of the middle one, whose index is 2.
#[test]
fn photos_taken_on_the_way_forward_are_shown_as_an_early_one_saw_it() {
    let views =
        gallery_from(&[[0.0, 1.0, 0.06], [0.05, 0.5, 0.03], [0.0, 0.0, 0.0], [-0.05, -0.6, -0.03], [0.0, -1.2, -0.06]]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 5]);
    assert_eq!(found.reference, 4);
}

#[test]
fn chosen_reference_stays() {
    let views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    for reference in [0, 2] {
        let options = ManyOptions { reference: Some(reference), ..ManyOptions::default() };
        let found = align_many(&photos(&views), &options, &mut ()).unwrap();
        assert_eq!((found.reference, found.order[0], found.order.len()), (reference, reference, 3));
        let [seen, _] = landing_errors(&found, &views);
        assert!(seen < 1.5, "{seen} px");
    }
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(found.reference, 1, "the one in the middle");
}

/// A photo that was shaken shows only what a sharp one between it and the reference does not.
#[test]
fn the_sharper_photo_shows() {
    let mut views = gallery_from(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.3], [0.0, 0.0, 0.2]]);
    let sharp = views.0[1].rgba.clone();
    for (i, blurred) in views.0[1].rgba.iter_mut().enumerate() {
        let (x, y) = (i / 4 % SIZE.0, i / 4 / SIZE.0);
        let place = |by: usize| [(x + by).min(SIZE.0 - 1), (y + by).min(SIZE.1 - 1)];
        let along = (0..9).map(|by| u32::from(sharp[4 * (place(by)[1] * SIZE.0 + place(by)[0]) + i % 4]));
        *blurred = (along.sum::<u32>() / 9) as u8;
    }
    let options = ManyOptions { reference: Some(0), ..ManyOptions::default() };
    let done = stitch_many(&photos(&views), &options, &mut ()).unwrap();
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
    let shown = |photo: u8| done.labels.data().iter().filter(|label| **label == photo + 1).count();
    assert!(2 * shown(1) < shown(2), "{} pixels of the blurred photo, {} of the sharp one", shown(1), shown(2));
}

#[test]
fn the_same_photo_twice_does_no_harm() {
    let mut views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0]]);
    views.0.push(views.0[0].clone());
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 3]);
    let [seen, _] = landing_errors(&found, &views);
    assert!(seen < 1.5, "{seen} px");
}

#[test]
fn the_same_photos_give_the_same_bytes() {
    let views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let run = || stitch_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(run(), run());
}
