//! PSNR, SSIM and coverage through the public function.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod pictures;

use depthstitch::metrics::{Quality, quality};
use depthstitch::warp::{RELIABLE, Warped};
use depthstitch::{Error, Image, Mask};
use pictures::picture;

fn warped(image: Image, offset: (usize, usize)) -> Warped {
    let footprint = Mask::new(vec![255; image.width() * image.height()], image.width(), image.height()).unwrap();
    Warped { image, footprint, confidence: None, depth: None, offset, clipped: false }
}

/// 40 + 3x + 2y + ⌊xy/9⌋(c + 1) + 17c mod 256
fn pattern(x: i64, y: i64, c: i64) -> i64 {
    (40 + 3 * x + 2 * y + (x * y).div_euclid(9) * (c + 1) + 17 * c).rem_euclid(256)
}

fn reference(width: usize, height: usize) -> Image {
    picture(width, height, |x, y| {
        let [r, g, b] = [0, 1, 2].map(|c| pattern(x as i64, y as i64, c) as u8);
        [r, g, b, 255]
    })
}

/// The reference's pattern on the canvas with a disturbance of −30 to 30, in an ellipse with pinholes.
fn target(width: usize, height: usize, offset: (usize, usize)) -> Warped {
    let image = picture(width, height, |x, y| {
        let (u, v) = (x as i64, y as i64);
        let (dx, dy) = (u - width as i64 / 2, v - height as i64 / 2);
        let side = width.min(height) as i64;
        let inside = dx * dx * 4 + dy * dy * 9 < 36 * side * side / 16 && (u * 5 + v * 3) % 23 != 0;
        let [r, g, b] = [0, 1, 2].map(|c| {
            let noise = ((u * 7 + v * 13 + c * 29) * (u + 3 * v + 5) / 4) % 61 - 30;
            (pattern(u - offset.0 as i64, v - offset.1 as i64, c) + noise).clamp(0, 255) as u8
        });
        if inside { [r, g, b, 255] } else { [0; 4] }
    });
    warped(image, offset)
}

fn measure(target: &Warped, reference: &Image) -> Quality {
    quality(target, reference.view(), [1.0; 3]).unwrap()
}

#[track_caller]
fn assert_near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} ± {tolerance}");
}

/// Expected values from scikit-image 0.26 (numpy float64) on these very pictures: overlap masked to black on both sides
/// and cut to its bounding box, `structural_similarity(a, b, channel_axis=2, gaussian_weights=True, sigma=1.5,
/// use_sample_covariance=False, data_range=255, full=True)`; its mean is ssim_bbox, its map over the mask ssim_mask.
#[test]
fn agrees_with_scikit_image() {
    let cases = [
        // reference, canvas, offset, [psnr_bbox, ssim_bbox, psnr_mask, ssim_mask, coverage]
        (
            (64, 48),
            (90, 70),
            (15, 9),
            [23.696761093927385, 0.9039805973113161, 23.504544841058767, 0.8893249453430061, 0.9567057291666666],
        ),
        (
            (64, 48),
            (64, 48),
            (0, 0),
            [24.38506889751953, 0.9070544221488172, 23.532775242491265, 0.9074106024089399, 0.8046875],
        ),
        (
            (40, 60),
            (50, 80),
            (10, 11),
            [23.872950237838303, 0.9034051897117071, 23.48619241989537, 0.893279688533362, 0.7470833333333333],
        ),
    ];
    for (size, canvas, offset, expected) in cases {
        let q = measure(&target(canvas.0, canvas.1, offset), &reference(size.0, size.1));
        assert_near(q.psnr_bbox, expected[0], 1e-9);
        assert_near(q.ssim_bbox, expected[1], 2e-6);
        assert_near(q.psnr_mask, expected[2], 1e-9);
        assert_near(q.ssim_mask, expected[3], 2e-6);
        assert_near(q.coverage, expected[4], 1e-12);
    }
}

#[test]
fn identical_pictures_are_perfect() {
    for (width, height) in [(1, 1), (4, 30), (11, 11), (10, 40), (64, 48)] {
        let reference = reference(width, height);
        let q = measure(&warped(reference.clone(), (0, 0)), &reference);
        assert_eq!((q.psnr_bbox, q.psnr_mask), (f64::INFINITY, f64::INFINITY));
        assert_eq!((q.ssim_bbox, q.ssim_mask, q.coverage), (1.0, 1.0, 1.0));
    }
}

#[test]
fn exchanging_the_pictures_changes_nothing() {
    let (a, b) = (reference(37, 29), picture(37, 29, |x, y| [(x * y) as u8, (7 * x) as u8, (90 + y) as u8, 255]));
    let (q, p) = (measure(&warped(a.clone(), (0, 0)), &b), measure(&warped(b, (0, 0)), &a));
    assert_eq!(q, p);
}

/// Every pixel differs by 1 in one of three channels: the mean squared error is 1/3.
#[test]
fn psnr_of_a_known_error() {
    let a = reference(20, 20);
    let b = picture(20, 20, |x, y| {
        let [r, g, b, alpha] = a.view().pixel(x, y);
        [r, g ^ 1, b, alpha]
    });
    let q = measure(&warped(b, (0, 0)), &a);
    assert_near(q.psnr_mask, 10.0 * (3.0f64 * 65025.0).log10(), 1e-12);
    assert_eq!(q.psnr_bbox, q.psnr_mask);
}

#[test]
fn similarity_falls_as_the_error_grows() {
    let a = reference(60, 50);
    let measured: Vec<Quality> = [1, 4, 16, 48]
        .map(|amount| {
            let b = picture(60, 50, |x, y| {
                let [r, g, b, alpha] = a.view().pixel(x, y);
                let noise = |v: u8| if (x * 7 + y * 5) % 3 == 0 { v.saturating_add(amount) } else { v };
                [noise(r), noise(g), noise(b), alpha]
            });
            measure(&warped(b, (0, 0)), &a)
        })
        .into();
    for pair in measured.windows(2) {
        assert!(pair[1].ssim_bbox < pair[0].ssim_bbox && pair[1].ssim_mask < pair[0].ssim_mask);
        assert!(pair[1].psnr_bbox < pair[0].psnr_bbox);
    }
}

/// What lies under alpha 0, beside the overlap, and where the reference is masked must not count; black valid pixels must.
#[test]
fn only_the_mask_says_what_is_valid() {
    let reference = reference(40, 30);
    let hole = |x: usize, y: usize| x > 25 || (10..14).contains(&y);
    let clean = picture(50, 40, |x, y| {
        let inside = (3..43).contains(&x) && (2..32).contains(&y) && !hole(x - 3, y - 2);
        if inside { reference.view().pixel(x - 3, y - 2) } else { [0; 4] }
    });
    let mut dirty = clean.clone();
    for pixel in dirty.data_mut().chunks_exact_mut(4).filter(|pixel| pixel[3] == 0) {
        pixel.copy_from_slice(&[200, 3, 77, 0]);
    }
    let mut seethrough = reference.clone();
    let beside = |(i, _): &(usize, &mut [u8; 4])| hole(i % 40, i / 40);
    seethrough.pixels_mut().iter_mut().enumerate().filter(beside).for_each(|(_, pixel)| *pixel = [9, 8, 7, 0]);
    let q = measure(&warped(clean, (3, 2)), &reference);
    assert_eq!(q, measure(&warped(dirty.clone(), (3, 2)), &reference));
    // Coverage is a share of what is there.
    let there = Quality { coverage: 1.0, ..q };
    assert_eq!(there, measure(&warped(dirty, (3, 2)), &seethrough));
    assert_eq!((q.psnr_mask, q.ssim_mask), (f64::INFINITY, 1.0));
    assert_eq!(q.coverage, (26 * 26) as f64 / 1200.0);

    let black = warped(picture(40, 30, |_, _| [0, 0, 0, 255]), (0, 0));
    let q = measure(&black, &reference);
    assert_eq!(q.coverage, 1.0);
    assert!(q.psnr_mask < 10.0 && q.ssim_mask < 0.1);
}

/// Smaller than a window: nothing is cut off, and the bounding box is the single valid pixel.
#[test]
fn one_pixel_of_overlap() {
    let reference = picture(5, 4, |_, _| [100, 100, 100, 255]);
    let one = picture(5, 4, |x, y| if (x, y) == (3, 2) { [110, 110, 110, 255] } else { [0; 4] });
    let q = measure(&warped(one, (0, 0)), &reference);
    // Both are constant under the window: SSIM is its luminance term.
    let expected = (2.0 * 100.0 * 110.0 + 6.5025) / (100.0 * 100.0 + 110.0 * 110.0 + 6.5025);
    assert_near(q.ssim_bbox, expected, 1e-4);
    assert_near(q.ssim_mask, expected, 1e-4);
    assert_near(q.psnr_bbox, 10.0 * (65025.0f64 / 100.0).log10(), 1e-12);
    assert_eq!(q.coverage, 0.05);
}

#[test]
fn refuses_what_cannot_be_measured() {
    let reference = reference(12, 10);
    let empty = warped(picture(30, 30, |x, y| if x < 5 && y < 5 { [9, 9, 9, 255] } else { [0; 4] }), (6, 6));
    assert_eq!(quality(&empty, reference.view(), [1.0; 3]), Err(Error::NoOverlap { pixels: 0 }.into()));

    let small = warped(picture(15, 10, |_, _| [0, 0, 0, 255]), (4, 0));
    let error = Error::WrongSize { name: "canvas", expected: (16, 10), actual: (15, 10) };
    assert_eq!(quality(&small, reference.view(), [1.0; 3]), Err(error.into()));
    let far = warped(picture(15, 10, |_, _| [0, 0, 0, 255]), (0, usize::MAX));
    assert_eq!(quality(&far, reference.view(), [1.0; 3]).unwrap_err().code(), "size-mismatch");
}

/// A darker target is as good as it is once its exposure is matched; a gain that leads away from the reference is not used.
#[test]
fn a_gain_makes_up_for_exposure() {
    let level = |light: f64| (255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055) + 0.5) as u8;
    let light = |level: u8| ((f64::from(level) / 255.0 + 0.055) / 1.055).powf(2.4);
    let photo = picture(60, 40, |x, y| [40 + (x * 3) as u8, 60 + (y * 4) as u8, 90 + (x + y) as u8, 255]);
    let dark = picture(60, 40, |x, y| {
        let [r, g, b, _] = photo.view().pixel(x, y).map(|v| level(0.6 * light(v)));
        [r, g, b, 255]
    });
    let of = |target: &Image, gain: f64| {
        quality(&warped(target.clone(), (0, 0)), photo.view(), [gain; 3]).unwrap().psnr_mask
    };
    assert!(of(&dark, 1.0) < 22.0 && of(&dark, 1.0 / 0.6) > 45.0, "{} {}", of(&dark, 1.0), of(&dark, 1.0 / 0.6));
    assert_eq!(of(&photo, 2.0), f64::INFINITY);
    for gain in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = quality(&warped(dark.clone(), (0, 0)), photo.view(), [1.0, gain, 1.0]);
        assert_eq!(refused.unwrap_err().code(), "invalid-argument");
    }
}

#[test]
fn what_is_not_reliable_does_not_count() {
    let photo = reference(40, 30);
    let wrong = |x: usize| (10..20).contains(&x);
    let target = picture(40, 30, |x, y| if wrong(x) { [255, 0, 255, 255] } else { photo.view().pixel(x, y) });
    let data = (0..40 * 30).map(|i| if wrong(i % 40) { RELIABLE - 1 } else { RELIABLE }).collect();
    let confidence = Some(Mask::new(data, 40, 30).unwrap());
    let found = measure(&Warped { confidence, ..warped(target, (0, 0)) }, &photo);
    assert_eq!((found.psnr_mask, found.coverage), (f64::INFINITY, 0.75));
}
