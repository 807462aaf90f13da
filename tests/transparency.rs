//! Masked pixels of photos: whatever is beneath them, and beside them.
#![allow(clippy::unwrap_used)]

use depthstitch::features::{DetectOptions, detect};
use depthstitch::mosaic::{FillOptions, Mosaic};
use depthstitch::pipeline::many::{ManyOptions, Photo, stitch_many};
use depthstitch::pipeline::{Options, Stitched, align, stitch};
use depthstitch::warp::{WarpMode, WarpOptions};
use depthstitch::{Error, Image, InverseDepth, View};
use nalgebra::Vector3;
use scene::{MatchOptions, Photos, Pose, Random};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (320, 240);
const MATCHES: MatchOptions = MatchOptions { count: 300, sigma: 0.3, outliers: 0.1, seed: 1 };

fn gallery() -> Photos {
    Photos::of(&scene::gallery().render(SIZE.0, SIZE.1), &MATCHES)
}

fn in_disc([x, y]: [usize; 2], centre: [f64; 2], radius: f64) -> bool {
    let [dx, dy] = [x as f64 - centre[0], y as f64 - centre[1]];
    dx * dx + dy * dy < radius * radius
}

/// The photo without the pixels of which `hidden` is true; beneath them is noise by `seed`, below and above the threshold alike.
fn masked(photo: &Image, seed: u64, hidden: impl Fn([usize; 2]) -> bool) -> Image {
    let (width, height) = photo.size();
    let mut random = Random::new(seed);
    let mut byte = move |most: f64| (random.uniform() * most) as u8;
    let pixel = |(i, &[r, g, b, _]): (usize, &[u8; 4])| {
        if hidden([i % width, i / width]) {
            [byte(256.0), byte(256.0), byte(256.0), byte(128.0)]
        } else {
            [r, g, b, 128 + byte(128.0)]
        }
    };
    Image::new(photo.pixels().iter().enumerate().flat_map(pixel).collect(), width, height).unwrap()
}

fn person(at: [usize; 2]) -> bool {
    in_disc(at, [200.0, 150.0], 30.0)
}

/// As [`person`], in the part of the reference that the target shows as well.
fn other(at: [usize; 2]) -> bool {
    in_disc(at, [100.0, 130.0], 30.0)
}

fn logo([x, y]: [usize; 2]) -> bool {
    x < 60 && y > 200
}

fn run(target: &Image, reference: &Image, photos: Option<&Photos>, options: &Options) -> Stitched {
    let depth = |map: Option<&InverseDepth>| map.cloned();
    let maps = photos.map(|photos| [depth(photos.target_depth.as_ref()), depth(photos.reference_depth.as_ref())]);
    let [first, second] = maps.unwrap_or([None, None]);
    let matches = photos.map(|photos| &photos.matches[..]);
    let view = |image, depth| View { image, depth };
    let (target, reference) = (view(target.view(), first.as_ref()), view(reference.view(), second.as_ref()));
    stitch(matches, target, reference, options, &mut ()).unwrap()
}

/// The mean over what shows of a photo, `inside` of a part of the reference, of the largest difference of a channel from it.
fn difference(mosaic: &Mosaic, offset: (usize, usize), truth: &Image, inside: impl Fn([usize; 2]) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, truth) in truth.pixels().iter().enumerate() {
        let (x, y) = (i % SIZE.0, i / SIZE.0);
        let shown = mosaic.image.view().pixel(offset.0 + x, offset.1 + y);
        if inside([x, y]) && shown[3] != 0 {
            sum += f64::from((0..3).map(|c| shown[c].abs_diff(truth[c])).max().unwrap());
            count += 1.0;
        }
    }
    assert!(count > 0.0);
    sum / count
}

/// Whether nothing that counts is different; what is not known of depth is NaN, which is different from itself.
fn same(a: &Stitched, b: &Stitched) -> bool {
    a.mosaic == b.mosaic
        && a.warped.image == b.warped.image
        && a.warped.footprint == b.warped.footprint
        && a.warped.confidence == b.warped.confidence
        && a.geometry.forward == b.geometry.forward
        && a.quality == b.quality
}

fn modes() -> Vec<Options> {
    let warped = |mode| Options { warp: WarpOptions { mode, ..WarpOptions::default() }, ..Options::default() };
    let coarse = WarpOptions { grid: (20, 15), ..WarpOptions::default() };
    vec![
        Options::default(),
        Options::paper(),
        warped(WarpMode::Forward),
        Options { warp: coarse, ..Options::default() },
        Options { fill: Some(FillOptions::default()), ..Options::default() },
    ]
}

#[test]
fn what_is_beneath_makes_no_difference() {
    let photos = gallery();
    // With matches and depth, of which some belong to masked pixels; and with neither.
    for (given, options) in modes().iter().map(|options| (true, options)).chain([(false, &Options::default())]) {
        let made = [1, 2].map(|seed| {
            let target = masked(&photos.target, seed, |at| person(at) || logo(at));
            let reference = masked(&photos.reference, seed, person);
            run(&target, &reference, given.then_some(&photos), options)
        });
        let [first, second] = made;
        assert!(same(&first, &second));
    }
}

#[test]
fn alpha_counts_from_one_half_on() {
    let photos = gallery();
    let [target, reference] = [&photos.target, &photos.reference].map(|photo| masked(photo, 3, |_| false));
    assert!(!target.view().is_masked());
    let opaque = run(&photos.target, &photos.reference, Some(&photos), &Options::default());
    assert!(same(&run(&target, &reference, Some(&photos), &Options::default()), &opaque));
}

#[test]
fn a_hole_of_the_reference_shows_the_target() {
    let photos = gallery();
    let whole = run(&photos.target, &photos.reference, Some(&photos), &Options::default());
    let reference = masked(&photos.reference, 1, other);
    let found = run(&photos.target, &reference, Some(&photos), &Options::default());
    let (left, top) = found.warped.offset;
    let (mut hidden, mut shown) = (0, 0);
    for (i, _) in photos.reference.pixels().iter().enumerate().filter(|(i, _)| other([i % SIZE.0, i / SIZE.0])) {
        let at = (top + i / SIZE.0) * found.mosaic.image.width() + left + i % SIZE.0;
        hidden += 1;
        shown += u32::from(found.mosaic.seam.data()[at] == 1);
        assert_ne!(found.mosaic.seam.data()[at], 2);
        // Either the target, or a void.
        assert_eq!(found.mosaic.seam.data()[at] == 0, found.mosaic.voids.data()[at] != 0);
    }
    assert!(shown * 10 > 8 * hidden, "{shown} of {hidden}");
    let [before, after] =
        [&whole, &found].map(|found| difference(&found.mosaic, found.warped.offset, &photos.reference, other));
    assert!(after < before + 15.0, "{before} {after}");
    // What is measured is what is there.
    assert!((found.quality.psnr_mask - whole.quality.psnr_mask).abs() < 1.0);
}

#[test]
fn a_hole_of_the_target_shows_the_reference() {
    let photos = gallery();
    let target = masked(&photos.target, 1, person);
    let found = run(&target, &photos.reference, Some(&photos), &Options::default());
    let whole = run(&photos.target, &photos.reference, Some(&photos), &Options::default());
    let [before, after] =
        [&whole, &found].map(|found| difference(&found.mosaic, found.warped.offset, &photos.reference, |_| true));
    assert!((before - after).abs() < 0.1, "{before} {after}");
}

#[test]
fn a_hole_of_both_is_a_void_and_gets_filled() {
    let photos = gallery();
    let hidden = |at| in_disc(at, [160.0, 60.0], 14.0);
    // The same place of the scene, more or less: the disc of the target is larger.
    let target = masked(&photos.target, 1, |at| in_disc(at, [130.0, 60.0], 90.0));
    let reference = masked(&photos.reference, 1, hidden);
    let open = run(&target, &reference, Some(&photos), &Options { fill: None, ..Options::default() });
    let fill = Some(FillOptions::default());
    let filled = run(&target, &reference, Some(&photos), &Options { fill, ..Options::default() });
    let (left, top) = open.warped.offset;
    let place = (top + 60) * open.mosaic.image.width() + left + 160;
    assert_eq!(open.mosaic.image.pixels()[place], [0; 4]);
    assert_eq!(open.mosaic.voids.data()[place], 255);
    assert_eq!(filled.mosaic.image.pixels()[place][3], 255);
}

#[test]
fn a_photo_ends_where_its_border_is_missing() {
    let photos = gallery();
    // An oval in either: the corners stay empty, and are no voids.
    let oval = |[x, y]: [usize; 2]| {
        let [u, v] = [x as f64 / 160.0 - 1.0, y as f64 / 120.0 - 1.0];
        u * u + v * v > 1.2
    };
    let [target, reference] = [&photos.target, &photos.reference].map(|photo| masked(photo, 1, oval));
    let fill = Some(FillOptions::default());
    let found = run(&target, &reference, Some(&photos), &Options { fill, ..Options::default() });
    let empty = found.mosaic.image.pixels().iter().zip(found.mosaic.voids.data());
    let open = empty.filter(|(pixel, void)| pixel[3] == 0 && **void == 0).count();
    assert!(open > 2000, "{open}");
    let (left, top) = found.warped.offset;
    assert_eq!(found.mosaic.image.view().pixel(left + SIZE.0 - 1, top + SIZE.1 - 1), [0; 4]);
    let whole = run(&photos.target, &photos.reference, Some(&photos), &Options::default());
    // The canvas is that of the ovals.
    assert!(found.mosaic.image.width() < whole.mosaic.image.width());
}

#[test]
fn features_touch_nothing_that_is_missing() {
    let photos = gallery();
    let photo = masked(&photos.target, 1, person);
    let found = detect(photo.view(), &DetectOptions::default(), &mut ()).unwrap();
    assert!(found.keypoints.len() > 100);
    for keypoint in &found.keypoints {
        let [dx, dy] = [keypoint.x - 200.0, keypoint.y - 150.0];
        let apart = (dx * dx + dy * dy).sqrt() - 30.0;
        assert!(apart > 10.0 * keypoint.scale, "{apart} {}", keypoint.scale);
    }
}

#[test]
fn a_photo_that_is_nowhere_there_is_named() {
    let photos = gallery();
    let nothing = masked(&photos.target, 1, |_| true);
    let view = |image| View { image, depth: None };
    let (given, none) = (view(photos.target.view()), view(nothing.view()));
    let pixels = (SIZE.0 * SIZE.1) as u64;
    for (target, reference, name) in [(none, given, "target"), (given, none, "reference")] {
        let expected = Error::TransparentPhoto { name, pixels };
        let error = *stitch(None, target, reference, &Options::default(), &mut ()).unwrap_err();
        assert_eq!(error, expected);
        assert_eq!(*align(None, target, reference, &Options::default(), &mut ()).unwrap_err(), expected);
        assert_eq!(error.code(), "invalid-argument");
    }
    let all = [photos.target.view(), nothing.view()].map(Photo::new);
    let error = *stitch_many(&all, &ManyOptions::default(), &mut ()).unwrap_err();
    assert_eq!(error.details(), [("pixels", pixels as f64), ("photo", 1.0)]);
    assert_eq!(
        error.to_string(),
        format!("photos[1]: photo is transparent: none of its {pixels} pixels has an alpha of 128 or more")
    );
}

#[test]
fn many_photos_show_what_others_hide() {
    let middle = |at| in_disc(at, [160.0, 130.0], 30.0);
    let scene = scene::gallery();
    let first = scene.target;
    let places = [[0.0, 0.0], [0.5, 0.05], [1.0, 0.1]];
    let pose = |[x, yaw]: [f64; 2]| Pose { centre: first.centre + Vector3::new(x, 0.0, 0.0), yaw, ..first };
    let views = scene.views(&places.map(pose), SIZE.0, SIZE.1);
    let images: Vec<Image> =
        views.0.iter().map(|view| Image::new(view.rgba.clone(), view.width, view.height).unwrap()).collect();
    let options = ManyOptions { reference: Some(1), ..ManyOptions::default() };
    let stitched = |seed: u64| {
        let masked: Vec<Image> = images.iter().map(|image| masked(image, seed, middle)).collect();
        let photos: Vec<Photo<'_>> = masked.iter().map(|image| Photo::new(image.view())).collect();
        stitch_many(&photos, &options, &mut ()).unwrap()
    };
    let found = stitched(1);
    let other = stitched(2);
    assert!(found.image == other.image && found.labels == other.labels && found.voids == other.voids);
    let (left, top) = found.offset;
    let (mut count, mut hidden) = (0, 0);
    for at in (0..SIZE.0 * SIZE.1).map(|i| [i % SIZE.0, i / SIZE.0]).filter(|at| middle(*at)) {
        let label = found.labels.data()[(top + at[1]) * found.image.width() + left + at[0]];
        assert_ne!(label, 2, "the reference is masked");
        hidden += 1;
        count += u32::from(label != 0);
    }
    assert!(4 * count > 3 * hidden, "{count} of {hidden}");

    // What was masked of the reference is no part of what is shown of it.
    let half = masked(&images[1], 1, |at| at[0] < SIZE.0 / 2);
    let photos = [&images[0], &half, &images[2]].map(|image| Photo::new(image.view()));
    let found = stitch_many(&photos, &options, &mut ()).unwrap();
    let [left, top, width, height] = found.photos[1].extent.unwrap();
    assert_eq!([left + width, top, height], [SIZE.0 as i64, 0, SIZE.1 as i64], "{:?}", found.photos[1].extent);
    assert_eq!(left, SIZE.0 as i64 / 2);
}
