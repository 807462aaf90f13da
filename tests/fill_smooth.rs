//! Filling through the public functions, the smooth way.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod pictures;

use depthstitch::mosaic::{FillMethod, FillOptions, fill};
use depthstitch::{Error, Image, Mask, Stage};
use pictures::{Watch, mask, picture, pixels};

const EMPTY: [u8; 4] = [0; 4];

fn smooth(radius: u32) -> FillOptions {
    FillOptions { method: FillMethod::Smooth, radius, ..Default::default() }
}

/// The picture with the voids cut out.
fn punched(image: &Image, voids: &Mask) -> Image {
    picture(image.width(), image.height(), |x, y| {
        if voids.data()[y * image.width() + x] != 0 { EMPTY } else { image.view().pixel(x, y) }
    })
}

fn filled(image: &Image, voids: &Mask, radius: u32) -> Image {
    let mut image = image.clone();
    fill(&mut image, voids, None, &smooth(radius), &mut ()).unwrap();
    image
}

fn disc(width: usize, height: usize, radius: i64) -> Mask {
    let (cx, cy) = (width as i64 / 2, height as i64 / 2);
    mask(width, height, |x, y| (x as i64 - cx).pow(2) + (y as i64 - cy).pow(2) < radius * radius)
}

#[test]
fn constant_surroundings_go_on() {
    for (voids, radius) in [(disc(50, 40, 15), 5), (disc(50, 40, 19), 1), (mask(50, 40, |x, y| x + y > 3), 12)] {
        let flat = picture(50, 40, |_, _| [203, 0, 77, 255]);
        assert_eq!(filled(&punched(&flat, &voids), &voids, radius), flat);
    }
}

/// Laplace's equation by Gauss–Seidel sweeps: the smooth filling that knows nothing of edges.
fn harmonic(image: &Image, voids: &Mask) -> Vec<f64> {
    let width = image.width();
    let mut red: Vec<f64> = pixels(image).iter().map(|p| f64::from(p[0])).collect();
    for _ in 0..2000 {
        for i in (0..red.len()).filter(|&i| voids.data()[i] != 0) {
            red[i] = (red[i - 1] + red[i + 1] + red[i - width] + red[i + width]) / 4.0;
        }
    }
    red
}

/// Mean absolute error over the voids.
fn error(red: impl Fn(usize) -> f64, truth: &Image, voids: &Mask) -> f64 {
    let inside = (0..voids.data().len()).filter(|&i| voids.data()[i] != 0);
    inside.map(|i| (red(i) - f64::from(truth.data()[4 * i])).abs()).sum::<f64>() / voids.count() as f64
}

/// An edge through the middle, in the direction (dx, dy), one pixel soft.
fn edge(size: usize, (dx, dy): (f64, f64)) -> Image {
    let (middle, length) = (size as f64 / 2.0, (dx * dx + dy * dy).sqrt());
    picture(size, size, |x, y| {
        let side = ((x as f64 - middle) * dy - (y as f64 - middle) * dx) / length;
        let level = (40.0 + 180.0 * (side + 0.5).clamp(0.0, 1.0)).round() as u8;
        [level, 255 - level, 90, 255]
    })
}

#[test]
fn an_edge_runs_on_through_the_void() {
    let voids = disc(80, 80, 14);
    for direction in [(1.0, 1.0), (1.0, -1.0), (2.0, 1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 3.0), (-3.0, 1.0)] {
        let truth = edge(80, direction);
        let image = punched(&truth, &voids);
        let result = filled(&image, &voids, 5);
        let ours = error(|i| f64::from(result.data()[4 * i]), &truth, &voids);
        let smooth = harmonic(&image, &voids);
        let theirs = error(|i| smooth[i], &truth, &voids);
        println!("edge along {direction:?}: mean error {ours:.2}, harmonic {theirs:.2}");
        assert!(ours < 0.4 * theirs, "along {direction:?}: {ours} against {theirs}");
    }
}

#[test]
fn a_ramp_stays_within_its_surroundings() {
    let ramp = picture(60, 50, |x, y| [(2 * x + y) as u8, (4 * y) as u8, 17, 255]);
    let voids = disc(60, 50, 9);
    let result = filled(&punched(&ramp, &voids), &voids, 5);
    assert!(error(|i| f64::from(result.data()[4 * i]), &ramp, &voids) < 8.0);
    for (i, pixel) in pixels(&result).iter().enumerate().filter(|&(i, _)| voids.data()[i] != 0) {
        assert!((40..=150).contains(&pixel[0]) && pixel[2] == 17 && pixel[3] == 255, "{pixel:?} at {i}");
    }
}

#[test]
fn nothing_but_voids_is_touched() {
    let image = picture(40, 30, |x, y| match (x * 3 + y * 7) % 11 {
        0 => [9, 8, 7, 0],
        v => [(v * 20) as u8, (x * 5) as u8, (y * 7) as u8, if v == 1 { 128 } else { 255 }],
    });
    let voids = mask(40, 30, |x, y| (x / 4 + y / 3) % 3 == 0);
    let result = filled(&image, &voids, 4);
    for (i, (after, before)) in pixels(&result).iter().zip(pixels(&image)).enumerate() {
        if voids.data()[i] == 0 {
            assert_eq!(after, before);
        } else {
            assert_eq!(after[3], 255);
        }
    }
}

#[test]
fn what_the_voids_hold_does_not_matter() {
    let photo = picture(40, 30, |x, y| [(x * y) as u8, (x * 6) as u8, (y * 8) as u8, 255]);
    let voids = disc(40, 30, 8);
    assert_eq!(filled(&photo, &voids, 5), filled(&punched(&photo, &voids), &voids, 5));
}

/// Voids at the picture's border, and thin diagonal ones that only corners join.
#[test]
fn every_reachable_void_is_filled() {
    let photo = picture(31, 23, |x, y| [(8 * x) as u8, (11 * y) as u8, 50, 255]);
    for voids in [
        mask(31, 23, |x, y| x < 9 || y > 17),
        mask(31, 23, |x, y| x == y),
        mask(31, 23, |x, y| (x, y) != (30, 22)),
        mask(31, 23, |_, y| y == 0),
    ] {
        for radius in [1, 5, 64] {
            let result = filled(&punched(&photo, &voids), &voids, radius);
            assert!(pixels(&result).iter().all(|pixel| pixel[3] == 255));
        }
    }
}

#[test]
fn an_unreachable_void_stays() {
    // A void behind a transparent moat of one pixel, and one at the photo.
    let voids = mask(40, 20, |x, y| (4..10).contains(&y) && ((6..12).contains(&x) || (25..30).contains(&x)));
    let moat = |x: usize, y: usize| (3..11).contains(&y) && (5..13).contains(&x);
    let image = picture(40, 20, |x, y| if moat(x, y) { EMPTY } else { [50, 60, 70, 255] });
    let result = filled(&image, &voids, 5);
    for (i, pixel) in pixels(&result).iter().enumerate() {
        assert_eq!(pixel[3] == 0, moat(i % 40, i / 40));
    }
    let transparent = picture(40, 20, |_, _| EMPTY);
    assert_eq!(filled(&transparent, &voids, 5), transparent);
    let none = mask(40, 20, |_, _| false);
    assert_eq!(filled(&image, &none, 5), image);
}

/// The result follows the picture when it is turned over: no direction is preferred.
#[test]
fn mirroring_commutes_with_filling() {
    let photo = picture(45, 33, |x, y| [((x * x + 3 * y) / 3) as u8, (x * 5) as u8, (y * x / 2) as u8, 255]);
    let voids = mask(45, 33, |x, y| (x / 5 + y / 6) % 3 == 0);
    let turn = |image: &Image| picture(45, 33, |x, y| image.view().pixel(44 - x, y));
    let turned = mask(45, 33, |x, y| voids.data()[y * 45 + 44 - x] != 0);
    let result = turn(&filled(&photo, &voids, 5));
    let other = filled(&turn(&photo), &turned, 5);
    // Sums are taken in another order: one level of rounding.
    assert!(result.data().iter().zip(other.data()).all(|(a, b)| a.abs_diff(*b) <= 1));
}

#[test]
fn reports_progress_and_can_be_stopped() {
    let photo = picture(200, 200, |x, y| [x as u8, y as u8, 0, 255]);
    let voids = disc(200, 200, 80);
    let (mut image, mut watch) = (photo.clone(), Watch::new(Stage::Fill));
    fill(&mut image, &voids, None, &smooth(5), &mut watch).unwrap();
    assert!(watch.seen.len() >= 4 && watch.seen.is_sorted());
    assert_eq!((watch.seen[0], watch.seen[watch.seen.len() - 1]), (0.0, 1.0));

    let (mut image, mut watch) = (photo.clone(), Watch::until(Stage::Fill, 0.4));
    let result = fill(&mut image, &voids, None, &smooth(5), &mut watch);
    assert_eq!(result, Err(Error::Aborted.into()));
    assert_eq!(image, photo);
}

#[test]
fn refuses_bad_options_and_sizes() {
    let photo = picture(8, 6, |_, _| [1, 2, 3, 255]);
    let refused = |voids: &Mask, radius: u32| {
        let mut image = photo.clone();
        let error = fill(&mut image, voids, None, &smooth(radius), &mut ()).unwrap_err();
        assert_eq!(image, photo);
        (error.code(), error.details(), error.to_string())
    };
    let voids = mask(8, 6, |x, _| x == 3);
    for radius in [0, 65] {
        let (code, details, _) = refused(&voids, radius);
        assert_eq!((code, details), ("invalid-argument", vec![("value", f64::from(radius))]));
    }
    let turned = mask(6, 8, |x, _| x == 3);
    let sizes = vec![("width", 6.0), ("height", 8.0), ("expectedWidth", 8.0), ("expectedHeight", 6.0)];
    assert_eq!(refused(&turned, 5), ("size-mismatch", sizes, "voids is 6×8 pixels, expected 8×6".into()));
}
