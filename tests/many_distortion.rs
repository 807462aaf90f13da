//! Many photos by a lens that distorts, of rendered scenes of which everything is known.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::MultiViewKind;
use depthstitch::pipeline::many::{ManyOptions, PhotoCode, StitchedMany, stitch_many};
use depthstitch::warp::Projection;
use scene::{SIZE, Views, distance, gallery_through, median, photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const LOOP: [[f64; 3]; 5] = [[-0.4, 0.0, -0.1], [-0.4, 0.5, -0.05], [0.1, 0.5, 0.05], [0.4, 0.3, 0.1], [0.1, 0.0, 0.0]];

/// On the plane, with maps.
fn stitched(views: &Views) -> StitchedMany {
    let mut options = ManyOptions::default();
    options.stages.output_depth = true;
    options.stages.projection = Some(Projection::Plane);
    let done = stitch_many(&photos(views), &options, &mut ()).unwrap();
    assert!(done.photos.iter().all(|photo| photo.code == PhotoCode::Used), "{:?}", done.photos);
    done
}

/// The middle of a picture.
fn middle((width, height): (usize, usize)) -> [f64; 2] {
    [width, height].map(|side| 0.5 * (side as f64 - 1.0))
}

/// Where a pixel of a photo is in a frame of another size with the same middle.
fn in_frame([x, y]: [f64; 2], size: (usize, usize), frame: (usize, usize)) -> [f64; 2] {
    let (from, to) = (middle(size), middle(frame));
    [x - from[0] + to[0], y - from[1] + to[1]]
}

/// The median distance in pixels of where the pixels of all photos land in the reference's view from where they should, of those that it
/// sees; and by how many levels the mosaic differs there from the photo that it shows, at the median.
fn errors(done: &StitchedMany, views: &Views) -> [f64; 2] {
    let (mut places, mut colours) = (Vec::new(), Vec::new());
    let frame =
        |photo: usize| done.photos[photo].map.as_ref().unwrap().undistorted.as_ref().map_or(SIZE, |image| image.size());
    let reference = &views.0[done.reference];
    for (photo, view) in views.0.iter().enumerate() {
        let map = done.photos[photo].map.as_ref().unwrap();
        for (x, y) in (0..SIZE.1).step_by(7).flat_map(|y| (0..SIZE.0).step_by(7).map(move |x| (x, y))) {
            let point = view.camera.centre + view.camera.direction(x as f64, y as f64) * view.depth[y * SIZE.0 + x];
            let own = in_frame(view.camera.undistorted([x as f64, y as f64]), SIZE, frame(photo));
            let Some((there, _)) = reference.camera.project(point) else { continue };
            if !(there[0] >= 0.0 && there[1] >= 0.0 && there[0] < SIZE.0 as f64 && there[1] < SIZE.1 as f64) {
                continue;
            }
            let [u, v] = in_frame(reference.camera.undistorted(there), SIZE, frame(done.reference));
            if photo != done.reference {
                let depth = map.depth.as_ref().map_or(0.0, |depth| depth.sample(own[0], own[1]));
                places.push(
                    map.forward.project(own[0], own[1], depth).map_or(f64::INFINITY, |found| distance(found, [u, v])),
                );
            }
            let at = (v.round() as usize + done.offset.1) * done.image.width() + u.round() as usize + done.offset.0;
            if done.labels.data().get(at) == Some(&(photo as u8 + 1)) {
                let (pixel, shown) = (view.rgb(x, y), done.image.pixels()[at]);
                colours.push((0..3).map(|c| f64::from(pixel[c].abs_diff(shown[c]))).sum::<f64>() / 3.0);
            }
        }
    }
    [median(places), median(colours)]
}

#[test]
fn barrel_and_pincushion_are_found_and_not_shown() {
    for distortion in [-0.25, 0.2] {
        let views = gallery_through(&LOOP, distortion);
        let done = stitched(&views);
        assert_eq!(done.geometry, MultiViewKind::Cameras);
        assert!((done.distortion - distortion).abs() < 0.03, "{} instead of {distortion}", done.distortion);
        let [off, unlike] = errors(&done, &views);
        assert!(off < 1.0 && unlike < 6.0, "{distortion}: {off} px off, {unlike} levels");
        for report in &done.photos {
            let frame = report.map.as_ref().unwrap().undistorted.as_ref().unwrap().size();
            assert_eq!(frame > SIZE, distortion < 0.0, "{distortion}: {frame:?}");
        }
    }
}

#[test]
fn turning_camera_may_distort() {
    let views = gallery_through(&[[0.0, 0.0, -0.5], [0.0, 0.0, -0.25], [0.0, 0.0, 0.0], [0.0, 0.0, 0.25]], -0.2);
    let done = stitched(&views);
    assert!((done.distortion + 0.2).abs() < 0.03, "{}", done.distortion);
    let [off, unlike] = errors(&done, &views);
    assert!(off < 1.0 && unlike < 6.0, "{off} px off, {unlike} levels");
}

#[test]
fn nothing_is_changed_without_distortion() {
    let done = stitched(&gallery_through(&LOOP, 0.0));
    assert_eq!(done.distortion, 0.0);
    assert!(done.photos.iter().all(|photo| photo.map.as_ref().unwrap().undistorted.is_none()));
    let extent = done.photos[done.reference].extent.unwrap();
    assert_eq!(extent, [0, 0, SIZE.0 as i64, SIZE.1 as i64]);
}
