//! Many photos that are too large: for the memory limit, or to be aligned at their own size.
#![allow(clippy::unwrap_used, clippy::panic)]

use depthstitch::Stage;
use depthstitch::observer::Observer;
use depthstitch::pipeline::many::{ManyOptions, Photo, PhotoCode, StitchedMany, align_many, stitch_many};
use depthstitch::report::Warning;
use depthstitch::warp::Projection;
use scene::{Pose, SIZE, Views, gallery_from, gallery_through, median, photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Stops before anything is done.
struct Stop;

impl Observer for Stop {
    fn progress(&mut self, _: Stage, _: f32) -> bool {
        false
    }
}

/// Of a lens that is known.
const DISTORTION: f64 = -0.2;

/// Options with depth maps in the result, for a lens of this distortion.
fn options(max_bytes: u64, distortion: f64) -> ManyOptions {
    let mut options = ManyOptions { distortion: Some(distortion), ..ManyOptions::default() };
    options.stages.output_depth = true;
    options.stages.warp.max_bytes = max_bytes;
    options
}

/// The least memory in which photos are aligned at their own size.
fn least_bytes(photos: &[Photo<'_>], distortion: f64) -> u64 {
    let (mut few, mut enough) = (0u64, 1u64 << 31);
    while enough - few > 1 {
        let middle = few.midpoint(enough);
        match align_many(photos, &options(middle, distortion), &mut Stop).unwrap_err().code() {
            "too-large" => few = middle,
            _ => enough = middle,
        }
    }
    enough
}

fn is_near(own: f64, other: f64, most: f64) -> bool {
    (own - other).abs() <= most
}

/// The picture that the memory for aligning photos suffices for: half as wide and high as the other one, and of the same geometry.
fn check_half(photos: &[Photo<'_>], distortion: f64) -> StitchedMany {
    let whole = stitch_many(photos, &options(1 << 31, distortion), &mut ()).unwrap();
    assert_eq!((whole.scale, &whole.warnings[..]), (1.0, &[][..]));
    let half = stitch_many(photos, &options(least_bytes(photos, distortion), distortion), &mut ()).unwrap();
    assert_eq!((half.scale, &half.warnings[..]), (0.5, &[Warning::ReducedResolution { scale: 0.5 }][..]));
    let sides = |done: &StitchedMany| [done.image.width(), done.image.height(), done.offset.0, done.offset.1];
    for (own, other) in sides(&half).into_iter().zip(sides(&whole)) {
        assert!(is_near(2.0 * own as f64, other as f64, 4.0), "{:?} of {:?}", sides(&half), sides(&whole));
    }
    assert_eq!(
        (half.reference, half.projection, half.distortion),
        (whole.reference, whole.projection, whole.distortion)
    );
    for (own, other) in half.photos.iter().zip(&whole.photos) {
        // What is said of the photos is in their own pixels.
        assert_eq!((own.code, own.camera, own.focal, own.error), (other.code, other.camera, other.focal, other.error));
        assert_eq!(own.map, other.map);
        for (own, other) in own.extent.unwrap().into_iter().zip(other.extent.unwrap()) {
            assert!(is_near(2.0 * own as f64, other as f64, 6.0), "{own} of {other}");
        }
    }
    // Frames without distortion begin up to a pixel elsewhere.
    let reach: &[i64] = if distortion == 0.0 { &[0] } else { &[-1, 0, 1] };
    let shifts = reach.iter().flat_map(|&x| reach.iter().map(move |&y| [x, y]));
    let difference = shifts.map(|shift| difference(&half, &whole, shift)).fold(f64::INFINITY, f64::min);
    assert!(difference < 4.0, "{difference} levels");
    half
}

/// How much pixels differ at the median from the mean of the four that they were, this far to the right and below.
fn difference(half: &StitchedMany, whole: &StitchedMany, shift: [i64; 2]) -> f64 {
    let (width, (columns, rows)) = (half.image.width(), whole.image.size());
    let mut differences = Vec::new();
    for (i, pixel) in half.image.pixels().iter().enumerate().step_by(7).filter(|(_, pixel)| pixel[3] != 0) {
        let there = |at: usize, own: usize, other: usize, shift: i64| {
            usize::try_from(2 * (at as i64 - own as i64) + other as i64 + shift).ok()
        };
        let x = there(i % width, half.offset.0, whole.offset.0, shift[0]);
        let y = there(i / width, half.offset.1, whole.offset.1, shift[1]);
        let (Some(x), Some(y)) = (x, y) else { continue };
        if x + 1 < columns && y + 1 < rows {
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let sum: u32 = four.iter().map(|&(x, y)| u32::from(whole.image.pixels()[y * columns + x][1])).sum();
            differences.push((f64::from(sum) / 4.0 - f64::from(pixel[1])).abs());
        }
    }
    median(differences)
}

#[test]
fn what_does_not_fit_is_shown_at_half_the_size() {
    let views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    assert_eq!(check_half(&photos(&views), 0.0).projection, Projection::Plane);
}

#[test]
fn so_is_a_view_all_around() {
    let scene = scene::gallery();
    let pose = |yaw: f64| Pose { yaw, pitch: 0.12, focal: 0.9, ..scene.target };
    let views = scene.views(&[0.75, -0.25, 0.25, -0.75].map(pose), SIZE.0, SIZE.1);
    assert_eq!(check_half(&photos(&views), 0.0).projection, Projection::Cylinder);
}

#[test]
fn so_is_what_a_lens_has_distorted() {
    let views = gallery_through(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]], DISTORTION);
    assert_eq!(check_half(&photos(&views), DISTORTION).distortion, DISTORTION);
}

/// The median distance in pixels of where the pixels of all photos land in the reference from where they should.
fn landing_error(done: &StitchedMany, views: &Views) -> f64 {
    let mut errors = Vec::new();
    for (photo, report) in done.photos.iter().enumerate().filter(|(photo, _)| *photo != done.reference) {
        let map = report.map.as_ref().unwrap();
        let (width, height) = (views.0[photo].width, views.0[photo].height);
        let depth = map.depth.as_ref().unwrap();
        assert_eq!(depth.size(), (width, height));
        for (x, y) in (0..height).step_by(13).flat_map(|y| (0..width).step_by(13).map(move |x| (x, y))) {
            let Some([u, v]) = views.place([photo, done.reference], [x, y]) else { continue };
            let [p, q] = map.forward.project(x as f64, y as f64, f64::from(depth.data()[y * width + x])).unwrap();
            errors.push(((p - u) * (p - u) + (q - v) * (q - v)).sqrt());
        }
    }
    median(errors)
}

#[test]
fn what_cannot_be_aligned_at_its_size_is_at_half_of_it() {
    let scene = scene::gallery();
    let pose = |x: f64| {
        let mut pose = Pose { yaw: 0.25 * x, ..scene.target };
        pose.centre.x += x;
        pose
    };
    // The lower half is a pixel higher than that of an even side.
    let views = scene.views(&[-0.4, 0.0, 0.4].map(pose), 641, 480);
    let photos = photos(&views);
    let done = stitch_many(&photos, &options(least_bytes(&photos, 0.0) - 1, 0.0), &mut ()).unwrap();
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used));
    let (focal, truth) = (done.photos[0].focal.unwrap(), views.0[0].camera.k[(0, 0)]);
    assert!((focal / truth - 1.0).abs() < 0.03, "{focal} instead of {truth}");
    let error = landing_error(&done, &views);
    assert!(error < 3.0, "{error} px");
}

#[test]
fn what_cannot_be_made_small_enough_is_refused() {
    let views = gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0]]);
    assert_eq!(stitch_many(&photos(&views), &options(1_000_000, 0.0), &mut Stop).unwrap_err().code(), "too-large");
}
