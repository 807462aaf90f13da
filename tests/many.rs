//! Many photos of rendered scenes, of which everything is known.
#![allow(clippy::unwrap_used)]

mod scene;

use depthstitch::geometry::{Camera, MultiViewKind};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::observer::Observer;
use depthstitch::pipeline::many::{
    ManyAlignment, ManyOptions, Photo, PhotoCode, align_many, stitch_many, stitch_many_known,
};
use depthstitch::report::Warning;
use depthstitch::warp::Projection;
use depthstitch::{Error, ImageView, InverseDepth, Stage};
use nalgebra::{Matrix3, Vector3};
use scene::{Pose, View, Views, median};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (320, 240);

fn photos(views: &Views) -> Vec<Photo<'_>> {
    let image = |data, width, height| ImageView::new("photo", data, width, height).unwrap();
    views.0.iter().map(|view| Photo::new(image(&view.rgba, view.width, view.height))).collect()
}

/// Cameras in front of the gallery, each at (x, z) in metres and turned by an angle to the right.
fn gallery(places: &[[f64; 3]]) -> Views {
    let scene = scene::gallery();
    let first = scene.target;
    let pose = |&[x, z, yaw]: &[f64; 3]| Pose { centre: first.centre + Vector3::new(x, 0.0, z), yaw, ..first };
    scene.views(&places.iter().map(pose).collect::<Vec<_>>(), SIZE.0, SIZE.1)
}

fn codes(found: &ManyAlignment) -> Vec<&'static str> {
    found.codes.iter().map(|code| code.code()).collect()
}

/// The angle between rotations, in degrees.
fn angle(r: &Matrix3<f64>) -> f64 {
    libm::acos(((r.trace() - 1.0) / 2.0).clamp(-1.0, 1.0)).to_degrees()
}

/// The largest errors of all pairs: of the rotation and of the direction of the translation, in degrees.
fn camera_errors(found: &ManyAlignment, views: &Views) -> [f64; 2] {
    let cameras: Vec<Camera> = (0..views.0.len()).filter_map(|photo| found.report(photo).camera).collect();
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

/// The median distance in pixels of where the pixels of all photos land in the reference's view from where they should: of
/// those that some other photo sees, and of the rest.
fn landing_errors(found: &ManyAlignment, views: &Views) -> [f64; 2] {
    let (mut seen, mut alone) = (Vec::new(), Vec::new());
    for &photo in found.order.iter().filter(|photo| **photo != found.reference) {
        let (model, depth) = found.map(photo).unwrap();
        for (x, y) in (0..SIZE.1).step_by(7).flat_map(|y| (0..SIZE.0).step_by(7).map(move |x| (x, y))) {
            let d = depth.map_or(0.0, |depth| f64::from(depth.data()[y * SIZE.0 + x]));
            let Some(truth) = views.place([photo, found.reference], [x, y]) else { continue };
            let place = model.project(x as f64, y as f64, d);
            let error = place.map_or(f64::INFINITY, |[u, v]| scene::distance([u, v], truth));
            let inside = |other: usize| {
                let [u, v] = views.place([photo, other], [x, y]).unwrap_or([-1.0; 2]);
                u >= 0.0 && v >= 0.0 && u < SIZE.0 as f64 && v < SIZE.1 as f64
            };
            let others = (0..views.0.len()).filter(|other| *other != photo).any(inside);
            if others { seen.push(error) } else { alone.push(error) }
        }
    }
    [seen, alone].map(median)
}

#[test]
fn strip_of_four_photos_is_one_picture() {
    let views = gallery(&[[-0.9, 0.0, -0.1], [-0.45, 0.1, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    let photos = photos(&views);
    let found = align_many(&photos, &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let [rotation, translation] = camera_errors(&found, &views);
    assert!(rotation < 0.6 && translation < 3.0, "{rotation}° of rotation, {translation}° of translation");
    let (focal, truth) = (found.report(0).focal.unwrap(), views.0[0].camera.k[(0, 0)]);
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
    let views = gallery(&[[0.0, 0.0, -0.5], [0.0, 0.0, -0.25], [0.0, 0.0, 0.0], [0.0, 0.0, 0.25]]);
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

/// Around a square and back: the last photo overlaps the first.
#[test]
fn loop_closes() {
    let views = gallery(&[[-0.4, 0.0, -0.1], [-0.4, 0.5, -0.05], [0.1, 0.5, 0.05], [0.4, 0.3, 0.1], [0.1, 0.0, 0.0]]);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 5]);
    let [rotation, translation] = camera_errors(&found, &views);
    assert!(rotation < 0.6 && translation < 5.0, "{rotation}° of rotation, {translation}° of translation");
    let [seen, alone] = landing_errors(&found, &views);
    assert!(seen < 1.5 && alone < 4.0, "{seen} px where two photos see, {alone} px elsewhere");
}

#[test]
fn photo_of_something_else_is_left_out() {
    let mut views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
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
    let mut views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let wall = scene::plane();
    views.0.extend(wall.views(&[wall.target, wall.reference], SIZE.0, SIZE.1).0);
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used", "used", "used", "other-group", "other-group"]);
    let options = ManyOptions { reference: Some(4), ..ManyOptions::default() };
    let found = align_many(&photos(&views), &options, &mut ()).unwrap();
    assert_eq!(codes(&found), ["other-group", "other-group", "other-group", "used", "used"]);
    assert_eq!(found.reference, 4);
}

#[test]
fn chosen_reference_stays() {
    let views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
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

#[test]
fn the_same_photo_twice_does_no_harm() {
    let mut views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0]]);
    views.0.push(views.0[0].clone());
    let found = align_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 3]);
    let [seen, _] = landing_errors(&found, &views);
    assert!(seen < 1.5, "{seen} px");
}

/// The camera that a view was rendered with.
fn camera(view: &View) -> Camera {
    let (rotation, centre) = (view.camera.r, view.camera.centre);
    Camera { rotation, translation: -(rotation * centre) }
}

fn depth_map(view: &View, of: impl Fn(f32, usize) -> f32) -> InverseDepth {
    let raw: Vec<f32> = view.inverse_depth().into_iter().enumerate().map(|(i, d)| of(d, i)).collect();
    InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
}

/// Photos of which the camera is known, and depth as `of` makes it of the true one.
fn with_cameras<'a>(views: &'a Views, depths: &'a [InverseDepth]) -> Vec<Photo<'a>> {
    let known = |(i, photo): (usize, Photo<'a>)| {
        let view = &views.0[i];
        Photo { focal: Some(view.camera.k[(0, 0)]), camera: Some(camera(view)), depth: depths.get(i), ..photo }
    };
    photos(views).into_iter().enumerate().map(known).collect()
}

#[test]
fn known_cameras_and_depth_stay_as_they_are() {
    let views = gallery(&[[-0.9, 0.0, -0.1], [0.0, 0.1, 0.0], [0.9, 0.0, 0.1]]);
    let exact: Vec<InverseDepth> = views.0.iter().map(|view| depth_map(view, |d, _| d)).collect();
    let photos = with_cameras(&views, &exact);
    let mut options = ManyOptions::default();
    options.stages.output_depth = true;
    let found = align_many(&photos, &options, &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 3]);
    for (photo, view) in views.0.iter().enumerate() {
        assert_eq!(found.report(photo).camera, Some(camera(view)));
        assert!((found.report(photo).focal.unwrap() / view.camera.k[(0, 0)] - 1.0).abs() < 1e-12);
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
    let views = gallery(&[[-0.45, 0.1, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    let options = ManyOptions::default();
    let found = align_many(&with_cameras(&views, &[]), &options, &mut ()).unwrap();
    assert_eq!(found.report(1).camera, Some(camera(&views.0[1])));
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

#[test]
fn cameras_are_checked() {
    let pixels = vec![128; 4 * 32 * 24];
    let own = Camera { rotation: Matrix3::identity(), translation: Vector3::zeros() };
    let photo = Photo::new(ImageView::new("photo", &pixels, 32, 24).unwrap());
    let known = Photo { focal: Some(30.0), camera: Some(own), ..photo };
    let refused = |photos: &[Photo<'_>]| *stitch_many(photos, &ManyOptions::default(), &mut Never).unwrap_err();
    let name = |error: Error| match error {
        Error::InvalidArgument { name, .. } => name,
        error => panic!("{error}"),
    };
    assert_eq!(name(refused(&[known, photo])), "camera");
    assert_eq!(name(refused(&[known, Photo { focal: None, ..known }])), "focalLength");
    for rotation in [Matrix3::identity() * 1.1, -Matrix3::identity(), Matrix3::from_element(f64::NAN)] {
        assert_eq!(name(refused(&[known, Photo { camera: Some(Camera { rotation, ..own }), ..known }])), "rotation");
    }
    let translation = Vector3::new(0.0, f64::INFINITY, 0.0);
    assert_eq!(name(refused(&[known, Photo { camera: Some(Camera { translation, ..own }), ..known }])), "translation");
    let small = InverseDepth::constant(1.0, 16, 12).unwrap();
    let error = refused(&[photo, Photo { depth: Some(&small), ..photo }]);
    assert!(matches!(error, Error::SizeMismatch { name: "depth", .. }), "{error}");
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
        let error = refused(&[photo, Photo { focal: Some(focal), ..photo }], &defaults);
        assert!(matches!(error, Error::InvalidArgument { name: "focalLength", .. }), "{error}");
    }
    let mut small = defaults.clone();
    small.stages.warp.max_bytes = 100_000;
    assert_eq!(refused(&[photo; 3], &small).code(), "too-large");
    let one = depthstitch::features::detect(photo.image, &defaults.stages.features.detect, &mut ()).unwrap();
    let mut narrow = one.clone();
    narrow.size.0 = 31;
    for (features, name, given) in [(vec![one.clone()], "features", 1.0), (vec![one, narrow], "features.width", 31.0)] {
        let error = *stitch_many_known(&[photo; 2], Some(features), &defaults, &mut Never).unwrap_err();
        assert!(
            matches!(error, Error::InvalidArgument { name: n, value, .. } if n == name && value == given),
            "{error}"
        );
    }
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
    let views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
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

#[test]
fn the_same_photos_give_the_same_bytes() {
    let views = gallery(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let run = || stitch_many(&photos(&views), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(run(), run());
}
