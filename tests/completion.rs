//! Depth that is completed inside the overlap and outside, and carried over to the other photo.
#![allow(clippy::unwrap_used)]

use depthstitch::depth::{CompletionOptions, Extrapolation, SurfaceShape, complete_depth, derive_depth};
use depthstitch::geometry::{Model, anisotropy};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::{Error, Image, InverseDepth, Mask};
use nalgebra::{Matrix3, Vector3};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn distance([a, b]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    libm::hypot(a - u, b - v)
}

fn map(size: (usize, usize), value: impl Fn(f64, f64) -> f64) -> InverseDepth {
    let raw: Vec<f32> = (0..size.0 * size.1).map(|i| value((i % size.0) as f64, (i / size.0) as f64) as f32).collect();
    InverseDepth::new("depth", &raw, size, DepthKind::Inverse, None, size).unwrap()
}

/// To the right by 60 to 100 pixels, a little larger and turned.
fn sideways() -> Model {
    let h = Matrix3::new(1.02, 0.03, 60.0, -0.03, 1.01, 4.0, 5e-5, 2e-5, 1.0);
    Model { h, e: Vector3::new(40.0, 5.0, 0.02) }
}

#[test]
fn completion_leaves_the_inside_and_reproduces_planes() {
    let size = (200, 150);
    let model = sideways();
    let plane = |x: f64, y: f64| 0.3 + 0.001 * x - 0.0015 * y;
    let garbage = |x: f64, y: f64| if model.project(x, y, plane(x, y)).unwrap()[0] < 197.0 { plane(x, y) } else { 7.0 };
    let found = complete_depth(&map(size, garbage), None, &model, size, None, &Default::default(), &mut ()).unwrap();
    for (found, expected) in found.data().iter().zip(map(size, plane).data()) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    // What is not a plane stays inside, is extrapolated without a step, and does not grow.
    let bump =
        |x: f64, y: f64| plane(x, y) + 0.5 * (-((x - 90.0) * (x - 90.0) + (y - 80.0) * (y - 80.0)) / 800.0).exp();
    let bumpy = map(size, |x, y| if model.project(x, y, bump(x, y)).unwrap()[0] < 197.0 { bump(x, y) } else { 7.0 });
    let found = complete_depth(&bumpy, None, &model, size, None, &Default::default(), &mut ()).unwrap();
    let mut largest = 0.0f64;
    for y in 0..size.1 {
        for x in 0..size.0 {
            let at = y * size.0 + x;
            let (a, b) = (f64::from(found.data()[at]), bump(x as f64, y as f64));
            let place = model.project(x as f64, y as f64, b).unwrap();
            if place[0] >= 3.0 && place[1] >= 3.0 && place[0] < 196.9 && place[1] < 147.0 {
                assert!((a - b).abs() < 1e-6);
            } else {
                assert!((a - plane(x as f64, y as f64)).abs() < 0.6, "{x} {y} {a}");
            }
            if x > 0 && y > 10 && y < 140 {
                largest = largest.max((found.data()[at] - found.data()[at - 1]).abs().into());
            }
        }
    }
    // The bump's own steepest slope is 0.5·0.607/20 per pixel.
    assert!(largest < 0.06, "{largest}");
    let far = |x: usize, y: usize| f64::from(found.data()[y * size.0 + x]) - plane(x as f64, y as f64);
    assert!(far(199, 149).abs() < 0.5 && far(199, 0).abs() < 0.5, "{} {}", far(199, 149), far(199, 0));
}

#[test]
fn completion_starts_from_what_is_reliable() {
    let size = (200, 150);
    let plane = |x: f64, y: f64| 0.3 + 0.001 * x - 0.0015 * y;
    // Half of the inside is wrong, and known to be.
    let depth = map(size, |x, y| if y < 90.0 { 1.2 } else { plane(x, y) });
    let mut mask = Mask::empty(size.0, size.1).unwrap();
    mask.data_mut().iter_mut().enumerate().filter(|(i, _)| i / size.0 >= 90).for_each(|(_, m)| *m = 255);
    let found = complete_depth(&depth, None, &sideways(), size, Some(&mask), &Default::default(), &mut ()).unwrap();
    assert!((f64::from(found.data()[145 * 200 + 195]) - plane(195.0, 145.0)).abs() < 0.01);
    let small = Mask::empty(3, 3).unwrap();
    let refused = complete_depth(&depth, None, &sideways(), size, Some(&small), &Default::default(), &mut ())
        .map_err(|error| *error);
    assert!(matches!(refused, Err(Error::WrongSize { name: "reliable", .. })));
    // Nothing inside: nothing to continue.
    let away = Model { h: Matrix3::new(1.0, 0.0, 9e3, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), ..sideways() };
    assert_eq!(complete_depth(&depth, None, &away, size, None, &Default::default(), &mut ()).unwrap(), depth);
}

/// A picture of two colours: of what is above the line y = 60 + 0.25·x, and of what is below it.
fn two_colours((w, h): (usize, usize)) -> Image {
    let mut image = Image::transparent(w, h).unwrap();
    for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
        let above = ((i / w) as f64) < 60.0 + 0.25 * (i % w) as f64;
        *pixel = if above { [220, 210, 190, 255] } else { [40, 60, 90, 255] };
    }
    image
}

#[test]
fn a_straight_edge_is_extrapolated_straight() {
    let (size, model) = ((240, 180), sideways());
    // A slanted wall that ends at a straight edge, before another plane.
    let edge = |x: f64| 60.0 + 0.25 * x;
    let truth = |x: f64, y: f64| if y < edge(x) { 0.2 + 0.002 * x } else { 0.9 - 0.001 * y };
    let mut mask = Mask::empty(size.0, size.1).unwrap();
    mask.data_mut().iter_mut().enumerate().filter(|(i, _)| i % size.0 < 110).for_each(|(_, m)| *m = 255);
    let wrong = |x: f64, y: f64| if x < 110.0 { truth(x, y) } else { 3.0 * (0.2 * x).sin() };
    let photo = two_colours(size);
    let found =
        complete_depth(&map(size, wrong), Some(photo.view()), &model, size, Some(&mask), &Default::default(), &mut ())
            .unwrap();
    // Just above the edge and along all of it, in pixels of the other photo.
    let images: Vec<[f64; 2]> = (20..230)
        .map(|x| [f64::from(x), edge(f64::from(x)) - 5.0])
        .map(|[x, y]| model.project(x, y, found.sample(x, y)).unwrap())
        .collect();
    let [a, b] = [images[0], images[images.len() - 1]];
    let length = distance(a, b);
    let bent = images.iter().map(|p| ((p[0] - a[0]) * (b[1] - a[1]) - (p[1] - a[1]) * (b[0] - a[0])).abs() / length);
    let bent = bent.fold(0.0, f64::max);
    assert!(bent < 1.0, "{bent}");
    // Both planes are extrapolated to the other side of the photo.
    for (x, y) in [(200, 20), (200, 60), (220, 160), (160, 150)] {
        let error = f64::from(found.data()[y * size.0 + x]) - truth(x as f64, y as f64);
        assert!(error.abs() < 0.12, "{x} {y} {error}");
    }
}

#[test]
fn extrapolated_depth_does_not_run_away() {
    let (size, model) = ((240, 180), sideways());
    let mut mask = Mask::empty(size.0, size.1).unwrap();
    mask.data_mut().iter_mut().enumerate().filter(|(i, _)| i % size.0 < 60).for_each(|(_, m)| *m = 255);
    // Steep and noisy where it is known.
    let noisy =
        map(size, |x, y| 0.5 + 0.3 * (y * 0.1).sin() + 0.02 * ((x * 12.9898 + y * 78.233).sin() * 43758.5).fract());
    let found = complete_depth(&noisy, None, &model, size, Some(&mask), &Default::default(), &mut ()).unwrap();
    assert!(found.data().iter().all(|d| (-1.0..2.0).contains(d)));
}

#[test]
fn derived_depth_leads_back() {
    let (size, other) = ((200, 150), (220, 160));
    let model = sideways();
    let depth = map(size, |x, y| 0.3 + 0.2 * (x / 200.0) * (x / 200.0) + 0.1 * (y / 150.0));
    let derived = derive_depth(&depth, &model, other, &mut ()).unwrap().unwrap();
    assert!(derived.data().iter().all(|d| d.is_finite()));
    let back = model.inverse().unwrap();
    let mut seen = 0;
    for y in 0..size.1 {
        for x in 0..size.0 {
            let (x, y) = (x as f64, y as f64);
            let [u, v] = model.project(x, y, depth.sample(x, y)).unwrap();
            if u >= 1.0 && v >= 1.0 && u <= 218.0 && v <= 158.0 {
                // Half a pixel of rounding, times what depth changes over it.
                assert!(distance(back.project(u, v, derived.sample(u, v)).unwrap(), [x, y]) < 0.2);
                seen += 1;
            }
        }
    }
    assert!(seen > 15_000);
}

#[test]
fn of_two_things_in_one_place_the_nearer_is_seen() {
    let size = (200, 150);
    let model = Model { h: Matrix3::identity(), e: Vector3::new(60.0, 0.0, 0.0) };
    // A board at 1 in front of a wall at 0: it moves by 60 pixels and covers the wall there, and leaves a gap.
    let depth = map(size, |x, y| if (40.0..80.0).contains(&x) && (40.0..100.0).contains(&y) { 1.0 } else { 0.0 });
    let derived = derive_depth(&depth, &model, size, &mut ()).unwrap().unwrap();
    let at = |x: usize, y: usize| derived.data()[y * 200 + x];
    assert!((100..140).all(|x| at(x, 70) == 1.0));
    assert!([10, 30, 90, 150].into_iter().all(|x| at(x, 70) == 0.0) && at(120, 20) == 0.0);
    // The gap is between, and filled from around.
    assert!((40..80).all(|x| (-0.5..1.0).contains(&at(x, 70))));
    // Nothing of it there.
    let away = Model { h: Matrix3::new(1.0, 0.0, 9e3, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), ..model };
    assert_eq!(derive_depth(&depth, &away, size, &mut ()).unwrap(), None);
    let singular = Model { h: Matrix3::zeros(), ..model };
    assert_eq!(derive_depth(&depth, &singular, size, &mut ()).unwrap(), None);
}

#[test]
fn a_surface_replaces_noise_as_well() {
    let (size, model) = ((240, 180), sideways());
    let truth = |x: f64, y: f64| 0.3 + 0.001 * x - 0.0005 * y;
    let noise = |x: f64, y: f64| 0.2 * (((x * 12.9898 + y * 78.233).sin() * 43758.5).fract());
    let options = CompletionOptions { keep_reliable: false, ..Default::default() };
    let noisy = map(size, |x, y| truth(x, y) + noise(x, y));
    let found = complete_depth(&noisy, None, &model, size, None, &options, &mut ()).unwrap();
    let worst = |map: &InverseDepth| {
        let error = |(i, d): (usize, &f32)| (f64::from(*d) - truth((i % size.0) as f64, (i / size.0) as f64)).abs();
        map.data().iter().enumerate().filter(|(i, _)| i % size.0 < 160).map(error).fold(0.0, f64::max)
    };
    assert!(worst(&noisy) > 0.19 && worst(&found) < 0.1, "{} {}", worst(&noisy), worst(&found));
}

#[test]
fn a_stiff_surface_gives_up_what_is_near_rather_than_bend() {
    let (size, model) = ((240, 180), sideways());
    let depth = map(size, |x, y| if (100.0..130.0).contains(&x) && y > 60.0 { 0.6 } else { 0.3 });
    let highest = |stiffness| {
        let shape = SurfaceShape { stiffness, ..Default::default() };
        let options = CompletionOptions { keep_reliable: false, shape };
        let found = complete_depth(&depth, None, &model, size, None, &options, &mut ()).unwrap();
        found.data().iter().fold(0.0, |most: f32, d| most.max(*d))
    };
    let (soft, stiff) = (highest(1.0), highest(1000.0));
    assert!(soft > 0.4 && stiff < 0.33, "{soft} {stiff}");
}

#[test]
fn a_tight_surface_goes_through_little_that_is_known_at_the_border_of_the_overlap() {
    // A wall, and before it something near of which the reference shows the right end: from x = 176 on. Another near thing is in the middle.
    let size = (400, 300);
    let h = Matrix3::new(1.0, 0.0, -200.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let model = Model { h, e: Vector3::new(40.0, 0.0, 0.0) };
    let near = |x: f64, y: f64| (100.0..200.0).contains(&y) && (x < 200.0 || (290.0..310.0).contains(&x));
    let depth = map(size, |x, y| if near(x, y) { 0.6 } else { 0.1 });
    let completed = |tight_at_border| {
        let shape = SurfaceShape { stiffness: 16.0, tight_at_border, ..Default::default() };
        let options = CompletionOptions { keep_reliable: false, shape };
        complete_depth(&depth, None, &model, size, None, &options, &mut ()).unwrap()
    };
    let [loose, tight] = [false, true].map(completed);
    for x in [165.0, 185.0] {
        let [loose, tight] = [&loose, &tight].map(|map| map.sample(x, 150.0));
        assert!(loose < 0.2 && tight > 0.4, "{x}: {loose} {tight}");
    }
    // What is in the middle stays an outlier.
    assert!(tight.sample(300.0, 150.0) < 0.2, "{}", tight.sample(300.0, 150.0));
}

#[test]
fn far_outside_the_surface_becomes_a_plane_in_which_nothing_leans() {
    // A wall down to y = 150, and ground in front of it that comes nearer below. The target shows much to the left of the reference.
    let (size, other) = ((400, 300), (400, 300));
    let h = Matrix3::new(1.0, 0.0, -200.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let model = Model { h, e: Vector3::new(40.0, 0.0, 0.0) };
    let truth = |_: f64, y: f64| if y < 150.0 { 0.1 } else { 0.1 + 0.008 * (y - 150.0) };
    let depth = map(size, truth);
    let completed = |extrapolation| {
        let shape = SurfaceShape { extrapolation, ..Default::default() };
        let options = CompletionOptions { keep_reliable: false, shape };
        complete_depth(&depth, None, &model, other, None, &options, &mut ()).unwrap()
    };
    let [surface, plane] = [Extrapolation::Surface, Extrapolation::Plane].map(completed);
    let at = |map: &InverseDepth, x: usize, y: usize| f64::from(map.data()[y * size.0 + x]);
    // Inside both are the scene, beyond the border there is only the extrapolated surface.
    for (x, y) in [(300, 50), (300, 250), (350, 280)] {
        let expected = truth(x as f64, y as f64);
        assert!((at(&surface, x, y) - expected).abs() < 0.1 && (at(&plane, x, y) - expected).abs() < 0.1, "{x} {y}");
    }
    assert!((at(&surface, 20, 280) - truth(20.0, 280.0)).abs() < 0.15, "{}", at(&surface, 20, 280));
    assert!((at(&plane, 20, 280) - 0.1).abs() < 0.15, "{}", at(&plane, 20, 280));
    let leaning = |map: &InverseDepth| anisotropy(size, &|x, y| model.project(x, y, map.sample(x, y))).unwrap();
    assert!(leaning(&plane) < 0.8 * leaning(&surface), "{} {}", leaning(&plane), leaning(&surface));
}

#[test]
fn shapes_out_of_range_are_refused() {
    let (size, model) = ((40, 30), sideways());
    let refused = |shape: SurfaceShape| {
        let options = CompletionOptions { shape, ..Default::default() };
        let error = complete_depth(&map(size, |_, _| 0.3), None, &model, size, None, &options, &mut ()).unwrap_err();
        matches!(*error, Error::InvalidArgument { .. })
    };
    for stiffness in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(SurfaceShape { stiffness, ..Default::default() }), "{stiffness}");
    }
    let extrapolation = Extrapolation::FrontoParallel(f64::NAN);
    assert!(refused(SurfaceShape { extrapolation, ..Default::default() }));
}

#[test]
fn anisotropy_is_that_of_the_map() {
    let of = |rows: [f64; 9]| {
        let model = Model::homography(Matrix3::from_row_slice(&rows));
        anisotropy((400, 300), &|x, y| model.project(x, y, 0.0))
    };
    let similarity = [0.6, -0.8, 5.0, 0.8, 0.6, -9.0, 0.0, 0.0, 1.0];
    assert!(of(similarity).unwrap() < 1e-6);
    let stretched = [2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert!((of(stretched).unwrap() - 2f64.ln()).abs() < 1e-6);
    let mirrored = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(of(mirrored), Some(3.0));
}
