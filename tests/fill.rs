//! Filling through the public functions: pieces of the background.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod fingerprint;
mod pictures;

use depthstitch::inverse_depth::DepthKind;
use depthstitch::mosaic::{BlendOptions, FillGuide, FillMethod, FillOptions, SeamGuide, blend, fill};
use depthstitch::warp::{WarpOptions, warp};
use depthstitch::{Error, Image, InverseDepth, Mask, Stage};
use fingerprint::fingerprint;
use pictures::{Watch, mask, picture};
use scene::{Camera, MatchOptions, Photos, Random, Scene, gallery};

fn map(width: usize, height: usize, depth: impl Fn(usize, usize) -> f32) -> InverseDepth {
    let raw: Vec<f32> = (0..width * height).map(|i| depth(i % width, i / width)).collect();
    InverseDepth::new("depth", &raw, (width, height), DepthKind::Inverse, None, (width, height)).unwrap()
}

/// Voids of any width: in small pictures all are wide.
fn any_width() -> FillOptions {
    FillOptions { max_width: 100.0, ..Default::default() }
}

/// The picture with the voids cut out and filled again.
fn refilled(image: &Image, voids: &Mask, guide: Option<&FillGuide>, options: &FillOptions) -> Image {
    let mut image = punched(image, voids);
    fill(&mut image, voids, guide, options, &mut ()).unwrap();
    image
}

fn punched(image: &Image, voids: &Mask) -> Image {
    let mut image = image.clone();
    for (pixel, _) in image.data_mut().chunks_exact_mut(4).zip(voids.data()).filter(|(_, void)| **void != 0) {
        pixel.fill(0);
    }
    image
}

/// PSNR over the voids, and of how many pixels.
fn psnr(image: &Image, voids: &Mask, truth: impl Fn(usize, usize) -> [u8; 3]) -> (f64, usize) {
    let (mut sum, mut count) = (0.0, 0);
    for (i, pixel) in image.data().chunks_exact(4).enumerate() {
        if voids.data()[i] != 0 && pixel[3] != 0 {
            let truth = truth(i % image.width(), i / image.width());
            sum += (0..3).map(|c| (f64::from(pixel[c]) - f64::from(truth[c])).powi(2)).sum::<f64>() / 3.0;
            count += 1;
        }
    }
    (10.0 * libm::log10(255.0 * 255.0 * count as f64 / sum), count)
}

/// How much nearer to the truth, in dB, pieces of the background are than what is carried on from the border, where
/// the reference's camera sees what its own picture does not hold and the target's hides.
fn gain(name: &str, scene: &Scene, (width, height): (usize, usize)) -> f64 {
    let pair = scene.render(width, height);
    let photos = Photos::of(&pair, &MatchOptions { count: 4, sigma: 0.0, outliers: 0.0, seed: 1 });
    let (target, reference) = (photos.target(), photos.reference());
    let mut warped = warp(target, reference, &pair.forward, &pair.reverse, &WarpOptions::paper(), &mut ()).unwrap();
    let mosaic = blend(&warped, reference.image, &SeamGuide::default(), &BlendOptions::paper(), &mut ()).unwrap();
    let guide = FillGuide::new(&mut warped, &mosaic.seam, &pair.forward, reference).unwrap();
    let camera = Camera::new(&scene.reference, width, height);
    let truth: Vec<[u8; 3]> = (0..mosaic.voids.data().len())
        .map(|i| {
            let (x, y) = (i % mosaic.image.width(), i / mosaic.image.width());
            let place = |at: usize, offset: usize| at as f64 - offset as f64;
            if mosaic.voids.data()[i] == 0 {
                return [0; 3];
            }
            scene.pixel(&camera, place(x, warped.offset.0), place(y, warped.offset.1))
        })
        .collect();
    let [smooth, exemplar] = [FillMethod::Smooth, FillMethod::Exemplar].map(|method| {
        let mut image = mosaic.image.clone();
        fill(&mut image, &mosaic.voids, guide.as_ref(), &FillOptions { method, ..Default::default() }, &mut ())
            .unwrap();
        let (psnr, filled) = psnr(&image, &mosaic.voids, |x, y| truth[y * image.width() + x]);
        assert_eq!(filled, mosaic.voids.count(), "{name}: a void is not filled");
        psnr
    });
    println!("{name}: {} voids, smooth {smooth:.2} dB, exemplar {exemplar:.2} dB", mosaic.voids.count());
    exemplar - smooth
}

const SMALL: (usize, usize) = (450, 300);
const LARGE: (usize, usize) = (600, 400);

#[test]
fn the_hidden_background_is_nearer_to_the_truth() {
    let mut swapped = gallery();
    std::mem::swap(&mut swapped.target, &mut swapped.reference);
    // What is found by chance makes a few tenths of a decibel.
    let gains = [SMALL, LARGE].map(|size| [gain("gallery", &gallery(), size), gain("swapped", &swapped, size)]);
    let gains = gains.as_flattened();
    assert!(gains.iter().sum::<f64>() >= 2.0 * gains.len() as f64 && gains.iter().all(|&gain| gain > 1.5), "{gains:?}");
}

#[test]
fn another_place_of_the_target_gains_as_much() {
    let mut scene = gallery();
    scene.target.centre.x += 1.6;
    scene.target.centre.z += 0.8;
    scene.target.yaw += 0.45;
    let gain = gain("from the right", &scene, SMALL);
    assert!(gain >= 2.0, "{gain}");
}

/// A near thing on the left, in red; behind it a far wall of green and blue patches, and a void between.
fn edge() -> (Image, Mask, FillGuide) {
    let (width, height) = (120, 80);
    let image = picture(width, height, |x, y| match x {
        0..40 => [200, (x * 2) as u8, (y % 7) as u8, 255],
        _ => [0, 20 + 60 * ((x / 5 + y / 5) % 3) as u8, 40 + 50 * ((x / 10 + y / 5) % 4) as u8, 255],
    });
    let voids = mask(width, height, |x, y| (40..60).contains(&x) && (5..75).contains(&y));
    let depth = map(width, height, |x, y| if x < 40 { 2.0 + 0.01 * y as f32 } else { 0.5 + 0.002 * y as f32 });
    (image, voids, FillGuide { depth, epipole: [1.0, 0.0, 0.0] })
}

#[test]
fn nothing_is_taken_from_what_is_in_front() {
    let (image, voids, guide) = edge();
    let result = refilled(&image, &voids, Some(&guide), &any_width());
    for (i, pixel) in result.data().chunks_exact(4).enumerate().filter(|&(i, _)| voids.data()[i] != 0) {
        assert!(pixel[0] == 0 && pixel[3] == 255, "{pixel:?} at {}, {}", i % 120, i / 120);
    }
    // Whatever affine change the depth has undergone, and with an epipole or without.
    let changed = |epipole, scale: f32, shift: f32| FillGuide {
        depth: map(120, 80, |x, y| scale * guide.depth.data()[y * 120 + x] + shift),
        epipole,
    };
    for guide in [changed([0.0; 3], 1.0, 0.0), changed([1.0, 0.0, 0.0], 64.0, -3.0)] {
        let result = refilled(&image, &voids, Some(&guide), &any_width());
        assert!(result.data().chunks_exact(4).zip(voids.data()).all(|(pixel, void)| *void == 0 || pixel[0] == 0));
    }
}

#[test]
fn both_sides_of_an_opening_are_in_front_of_what_is_seen_through_it() {
    // The upper half of an arch, in red: farther on its left than on its right, but the sky below is much farther.
    let sky = |x: usize, y: usize| x >= 80 && y >= 40;
    let image = picture(120, 100, |x, y| if sky(x, y) { [0, 90, 200, 255] } else { [180, (y % 9 * 9) as u8, 0, 255] });
    let voids = mask(120, 100, |x, y| (40..80).contains(&x) && (5..95).contains(&y));
    let depth = map(120, 100, |x, y| match x {
        _ if sky(x, y) => 0.1,
        0..60 => 2.0,
        _ => 3.0,
    });
    let guide = FillGuide { depth, epipole: [1.0, 0.0, 0.0] };
    let result = refilled(&image, &voids, Some(&guide), &any_width());
    for (i, pixel) in result.data().chunks_exact(4).enumerate().filter(|&(i, _)| voids.data()[i] != 0) {
        assert!(pixel[2] == 200, "{pixel:?} at {}, {}", i % 120, i / 120);
    }
}

#[test]
fn a_pattern_goes_on() {
    let truth = picture(140, 110, |x, y| {
        let dark = (x / 6 + y / 6) % 2 == 0;
        if dark { [30, 40, 60, 255] } else { [220, 200, 150, 255] }
    });
    let voids = mask(140, 110, |x, y| (x as i64 - 70).pow(2) + (y as i64 - 55).pow(2) < 18 * 18);
    let options = any_width();
    let smooth = FillOptions { method: FillMethod::Smooth, ..Default::default() };
    let found = |options: &FillOptions| {
        let result = refilled(&truth, &voids, None, options);
        psnr(&result, &voids, |x, y| {
            let [r, g, b, _] = truth.view().pixel(x, y);
            [r, g, b]
        })
    };
    let ((exemplar, filled), (smooth, _)) = (found(&options), found(&smooth));
    println!("checkers: {exemplar:.1} dB, smooth {smooth:.1} dB");
    assert_eq!(filled, voids.count());
    assert!(exemplar > smooth + 6.0, "{exemplar} against {smooth}");
}

#[test]
fn a_flat_colour_stays_flat() {
    let flat = picture(90, 70, |_, _| [203, 0, 77, 255]);
    let voids = mask(90, 70, |x, y| x / 20 % 2 == 1 && y > 7 && x + y > 60);
    assert!(refilled(&flat, &voids, None, &any_width()) == flat);
}

/// A sky: patches from elsewhere in it are too bright or too dark, and the eye sees steps of a few levels.
#[test]
fn a_ramp_goes_on_without_a_step() {
    let sky = |x: usize, y: usize| [60 + x as u8, 100 + (x / 2) as u8, 200 - (y / 2) as u8];
    let image = picture(120, 90, |x, y| {
        let [r, g, b] = sky(x, y);
        [r, g, b, 255]
    });
    let voids = mask(120, 90, |x, y| (45..75).contains(&x) && (25..65).contains(&y));
    let result = refilled(&image, &voids, None, &any_width());
    let border = |x: usize, y: usize| (x == 45 || x == 74 || y == 25 || y == 64) && voids.data()[y * 120 + x] != 0;
    for (x, y) in (0..120 * 90).map(|i| (i % 120, i / 120)).filter(|&(x, y)| border(x, y)) {
        let apart = (0..3).map(|c| result.view().pixel(x, y)[c].abs_diff(sky(x, y)[c])).max().unwrap();
        assert!(apart <= 4, "{apart} levels at {x}, {y}");
    }
}

#[test]
fn nothing_but_voids_is_touched_and_what_they_hold_does_not_matter() {
    let (image, voids, guide) = edge();
    let mut image = image;
    for (i, pixel) in image.data_mut().chunks_exact_mut(4).enumerate() {
        if i % 120 > 100 && i % 7 < 3 {
            pixel.copy_from_slice(&[9, 8, 7, if i % 2 == 0 { 0 } else { 128 }]);
        }
    }
    let result = refilled(&image, &voids, Some(&guide), &any_width());
    for ((after, before), void) in result.data().chunks_exact(4).zip(image.data().chunks_exact(4)).zip(voids.data()) {
        assert!(*void != 0 || after == before);
    }
    let mut opaque = image.clone();
    fill(&mut opaque, &voids, Some(&guide), &any_width(), &mut ()).unwrap();
    assert!(opaque == result);
}

/// Too wide a void stays open, except where it narrows.
#[test]
fn wide_voids_stay_transparent() {
    let image = picture(200, 160, |x, y| [(x * 7 % 200) as u8, (y * 5 % 150) as u8, 9, 255]);
    let wide = |x: usize, y: usize| (40..140).contains(&x) && (30..130).contains(&y);
    let narrow = |x: usize, y: usize| (140..190).contains(&x) && (76..84).contains(&y);
    let voids = mask(200, 160, |x, y| wide(x, y) || narrow(x, y));
    let filled = |max_width: f64| {
        let result = refilled(&image, &voids, None, &FillOptions { max_width, ..Default::default() });
        move |x: usize, y: usize| result.data()[4 * (y * 200 + x) + 3] != 0
    };
    let some = filled(0.2);
    assert!(!some(90, 80) && !some(45, 80) && !some(90, 125) && some(180, 80) && some(188, 77));
    let all = filled(2.0);
    assert!((0..200 * 160).all(|i| all(i % 200, i / 200)));
}

/// Gaps are filled smoothly, and so is all that no piece could be copied for.
#[test]
fn gaps_and_places_without_a_whole_patch_are_filled_smoothly() {
    let smooth = FillOptions { method: FillMethod::Smooth, ..Default::default() };
    let image = picture(60, 50, |x, y| [(4 * x) as u8, (5 * y) as u8, (x * y % 50) as u8, 255]);
    let gap = mask(60, 50, |x, y| x.abs_diff(y) < 2);
    let result = refilled(&image, &gap, None, &FillOptions::default());
    assert!(result == refilled(&image, &gap, None, &smooth));
    let ring = mask(60, 50, |x, y| !(27..33).contains(&x) || !(22..28).contains(&y));
    let all = any_width();
    assert!(refilled(&image, &ring, None, &all) == refilled(&image, &ring, None, &smooth));
    let none = mask(60, 50, |_, _| false);
    assert!(refilled(&image, &none, None, &all) == image);
}

/// The same bytes on every machine.
#[test]
fn the_result_is_always_the_same() {
    let mut random = Random::new(7);
    let noise: Vec<u8> = (0..120 * 80).map(|_| (random.uniform() * 40.0) as u8).collect();
    let (image, voids, guide) = edge();
    let image = picture(120, 80, |x, y| {
        let [r, g, b, _] = image.view().pixel(x, y);
        [r, g + noise[y * 120 + x], b, 255]
    });
    let result = refilled(&image, &voids, Some(&guide), &any_width());
    let hash = fingerprint(result.into_data().into_iter().map(u64::from));
    assert_eq!(hash, EXPECTED, "{hash:#x}");
}

const EXPECTED: u64 = 0xd5db886aea0ad43c;

#[test]
fn reports_progress_and_can_be_stopped() {
    let (image, voids, guide) = edge();
    let run = |watch: &mut Watch| {
        let mut image = image.clone();
        let result = fill(&mut image, &voids, Some(&guide), &any_width(), watch);
        (image, result)
    };
    let mut watch = Watch::new(Stage::Fill);
    run(&mut watch).1.unwrap();
    assert!(watch.seen.len() >= 4 && watch.seen.is_sorted(), "{:?}", watch.seen);
    assert_eq!((watch.seen[0], watch.seen[watch.seen.len() - 1]), (0.0, 1.0));
    for stop_at in [0.0, 0.3, 1.0] {
        let (image_after, result) = run(&mut Watch::until(Stage::Fill, stop_at));
        assert_eq!(result, Err(Error::Aborted.into()));
        assert!(stop_at == 1.0 || image_after == image);
    }
}

#[test]
fn refuses_bad_options_and_sizes() {
    let photo = picture(8, 6, |_, _| [1, 2, 3, 255]);
    let voids = mask(8, 6, |x, _| x == 3);
    let refused = |guide: Option<&FillGuide>, max_width: f64| {
        let mut image = photo.clone();
        let options = FillOptions { max_width, ..Default::default() };
        let error = fill(&mut image, &voids, guide, &options, &mut ()).unwrap_err();
        assert_eq!(image, photo);
        (error.code(), error.details())
    };
    assert_eq!(refused(None, -1.0), ("invalid-argument", vec![("value", -1.0)]));
    assert_eq!(refused(None, f64::INFINITY).0, "invalid-argument");
    assert_eq!(refused(None, f64::NAN).0, "invalid-argument");
    let guide = FillGuide { depth: map(6, 7, |_, _| 1.0), epipole: [0.0; 3] };
    let sizes = vec![("width", 6.0), ("height", 7.0), ("expectedWidth", 8.0), ("expectedHeight", 6.0)];
    assert_eq!(refused(Some(&guide), 0.2), ("size-mismatch", sizes));
}
