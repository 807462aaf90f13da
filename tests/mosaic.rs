//! Blending and filling through the public functions.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

use depthstitch::mosaic::{FillOptions, blend, fill};
use depthstitch::observer::Observer;
use depthstitch::warp::Warped;
use depthstitch::{Error, Image, Mask, Stage};

const EMPTY: [u8; 4] = [0; 4];

fn picture(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [u8; 4]) -> Image {
    let data =
        (0..height).flat_map(|y| (0..width).flat_map(move |x| [(x, y)])).flat_map(|(x, y)| pixel(x, y)).collect();
    Image { data, width, height }
}

fn mask(width: usize, height: usize, inside: impl Fn(usize, usize) -> bool) -> Mask {
    let data = (0..width * height).map(|i| if inside(i % width, i / width) { 255 } else { 0 }).collect();
    Mask { data, width, height }
}

fn pixels(image: &Image) -> &[[u8; 4]] {
    image.data.as_chunks().0
}

/// The picture with the voids cut out.
fn punched(image: &Image, voids: &Mask) -> Image {
    picture(image.width, image.height, |x, y| {
        if voids.data[y * image.width + x] != 0 { EMPTY } else { image.view().pixel(x, y) }
    })
}

fn filled(image: &Image, voids: &Mask, radius: u32) -> Image {
    let mut image = image.clone();
    fill(&mut image, voids, &FillOptions { radius }, &mut ()).unwrap();
    image
}

mod blending {
    #[cfg(target_arch = "wasm32")]
    use super::test;
    use super::*;

    fn warped(image: Image, footprint: Mask, offset: (usize, usize)) -> Warped {
        Warped { image, footprint, offset, clipped: false }
    }

    /// Target and reference, valid or not, black or not; a reference of 1×1 has neighbours that it does not cover.
    #[test]
    fn truth_table() {
        let cases = [
            ([10, 20, 31, 255], [20, 20, 30, 255], [15, 20, 31, 255]),
            ([0, 0, 0, 255], [100, 1, 255, 255], [50, 1, 128, 255]),
            ([100, 1, 255, 255], [0, 0, 0, 0], [50, 1, 128, 255]),
            ([0, 0, 0, 255], [0, 0, 0, 255], [0, 0, 0, 255]),
            ([255, 255, 255, 255], [255, 255, 254, 9], [255, 255, 255, 255]),
            (EMPTY, [7, 8, 9, 0], [7, 8, 9, 255]),
            (EMPTY, [0, 0, 0, 255], [0, 0, 0, 255]),
            ([70, 80, 90, 0], [7, 8, 9, 255], [7, 8, 9, 255]),
        ];
        for (target, reference, expected) in cases {
            let canvas = picture(3, 3, |_, _| target);
            let mosaic =
                blend(&warped(canvas, mask(3, 3, |_, _| true), (1, 1)), picture(1, 1, |_, _| reference).view())
                    .unwrap();
            let alone = if target[3] != 0 { target } else { EMPTY };
            for (i, &pixel) in pixels(&mosaic.image).iter().enumerate() {
                assert_eq!(pixel, if i == 4 { expected } else { alone });
            }
        }
    }

    #[test]
    fn every_pair_of_levels_is_rounded_to_nearest() {
        let canvas = picture(256, 256, |x, y| [x as u8, y as u8, 255 - x as u8, 255]);
        let reference = picture(256, 256, |x, y| [y as u8, x as u8, y as u8, 255]);
        let mosaic = blend(&warped(canvas, mask(256, 256, |_, _| true), (0, 0)), reference.view()).unwrap();
        for (i, pixel) in pixels(&mosaic.image).iter().enumerate() {
            let (x, y) = (i % 256, i / 256);
            let mean = |a: usize, b: usize| (a + b).div_ceil(2) as u8;
            assert_eq!(*pixel, [mean(x, y), mean(x, y), mean(255 - x, y), 255]);
        }
    }

    #[test]
    fn the_reference_lies_at_the_offset_and_voids_are_what_is_left_of_the_footprint() {
        let (width, height, offset) = (13, 9, (4, 2));
        let valid = |x: usize, y: usize| (x + 2 * y) % 5 < 2;
        let drawn = |x: usize, y: usize| (x + 2 * y) % 5 < 4;
        let under = |x: usize, y: usize| (4..10).contains(&x) && (2..7).contains(&y);
        let canvas = picture(width, height, |x, y| if valid(x, y) { [200, 0, 0, 255] } else { EMPTY });
        let reference = picture(6, 5, |x, y| [0, x as u8, y as u8, 255]);
        let mosaic = blend(&warped(canvas, mask(width, height, drawn), offset), reference.view()).unwrap();
        for (i, &pixel) in pixels(&mosaic.image).iter().enumerate() {
            let (x, y) = (i % width, i / width);
            let expected = match (valid(x, y), under(x, y)) {
                (true, true) => [100, (x - 4).div_ceil(2) as u8, (y - 2).div_ceil(2) as u8, 255],
                (true, false) => [200, 0, 0, 255],
                (false, true) => [0, (x - 4) as u8, (y - 2) as u8, 255],
                (false, false) => EMPTY,
            };
            assert_eq!(pixel, expected, "at {x}, {y}");
            let void = drawn(x, y) && !valid(x, y) && !under(x, y);
            assert_eq!(mosaic.voids.data[i], if void { 255 } else { 0 }, "at {x}, {y}");
        }
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let reference = picture(6, 5, |_, _| [1, 2, 3, 255]);
        let canvas = |width, height| picture(width, height, |_, _| EMPTY);
        let whole = |width, height| mask(width, height, |_, _| true);
        let mismatch = |name, expected, actual| Err(Error::SizeMismatch { name, expected, actual });
        let right = warped(canvas(8, 8), whole(8, 8), (3, 0));
        assert_eq!(blend(&right, reference.view()), mismatch("canvas width", 9, 8));
        let low = warped(canvas(8, 8), whole(8, 8), (2, 4));
        assert_eq!(blend(&low, reference.view()), mismatch("canvas height", 9, 8));
        let footprint = warped(canvas(8, 8), whole(16, 4), (0, 0));
        assert_eq!(blend(&footprint, reference.view()), mismatch("footprint width", 8, 16));
        let mut short = warped(canvas(8, 8), whole(8, 8), (0, 0));
        short.image.data.pop();
        assert_eq!(blend(&short, reference.view()), mismatch("warped", 256, 255));
        let empty = warped(canvas(0, 8), whole(0, 8), (0, 0));
        assert_eq!(blend(&empty, reference.view()).unwrap_err().code(), "invalid-argument");
    }
}

mod filling {
    #[cfg(target_arch = "wasm32")]
    use super::test;
    use super::*;

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
        let width = image.width;
        let mut red: Vec<f64> = pixels(image).iter().map(|p| f64::from(p[0])).collect();
        for _ in 0..2000 {
            for i in (0..red.len()).filter(|&i| voids.data[i] != 0) {
                red[i] = (red[i - 1] + red[i + 1] + red[i - width] + red[i + width]) / 4.0;
            }
        }
        red
    }

    /// Mean absolute error over the voids.
    fn error(red: impl Fn(usize) -> f64, truth: &Image, voids: &Mask) -> f64 {
        let inside = (0..voids.data.len()).filter(|&i| voids.data[i] != 0);
        inside.map(|i| (red(i) - f64::from(truth.data[4 * i])).abs()).sum::<f64>() / voids.count() as f64
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
            let ours = error(|i| f64::from(result.data[4 * i]), &truth, &voids);
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
        assert!(error(|i| f64::from(result.data[4 * i]), &ramp, &voids) < 8.0);
        for (i, pixel) in pixels(&result).iter().enumerate().filter(|&(i, _)| voids.data[i] != 0) {
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
            if voids.data[i] == 0 {
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
        let turned = mask(45, 33, |x, y| voids.data[y * 45 + 44 - x] != 0);
        let result = turn(&filled(&photo, &voids, 5));
        let other = filled(&turn(&photo), &turned, 5);
        // Sums are taken in another order: one level of rounding.
        assert!(result.data.iter().zip(&other.data).all(|(a, b)| a.abs_diff(*b) <= 1));
    }

    #[derive(Default)]
    struct Watch {
        seen: Vec<f32>,
        stop_at: Option<f32>,
    }

    impl Observer for Watch {
        fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
            assert_eq!(stage, Stage::Fill);
            self.seen.push(fraction);
            self.stop_at.is_none_or(|limit| fraction < limit)
        }
    }

    #[test]
    fn reports_progress_and_stops_when_told() {
        let photo = picture(200, 200, |x, y| [x as u8, y as u8, 0, 255]);
        let voids = disc(200, 200, 80);
        let (mut image, mut watch) = (photo.clone(), Watch::default());
        fill(&mut image, &voids, &FillOptions::default(), &mut watch).unwrap();
        assert!(watch.seen.len() >= 4 && watch.seen.is_sorted());
        assert_eq!((watch.seen[0], watch.seen[watch.seen.len() - 1]), (0.0, 1.0));

        let (mut image, mut watch) = (photo.clone(), Watch { stop_at: Some(0.4), ..Watch::default() });
        let result = fill(&mut image, &voids, &FillOptions::default(), &mut watch);
        assert_eq!(result, Err(Error::Aborted));
        assert_eq!(image, photo);
    }

    #[test]
    fn refuses_bad_options_and_sizes() {
        let photo = picture(8, 6, |_, _| [1, 2, 3, 255]);
        let refused = |voids: &Mask, radius: u32| {
            let mut image = photo.clone();
            let error = fill(&mut image, voids, &FillOptions { radius }, &mut ()).unwrap_err();
            assert_eq!(image, photo);
            (error.code(), error.details())
        };
        let voids = mask(8, 6, |x, _| x == 3);
        assert_eq!(refused(&voids, 0), ("invalid-argument", vec![("value", 0.0)]));
        assert_eq!(refused(&voids, 65), ("invalid-argument", vec![("value", 65.0)]));
        let turned = mask(6, 8, |x, _| x == 3);
        assert_eq!(refused(&turned, 5), ("size-mismatch", vec![("expected", 8.0), ("actual", 6.0)]));
        let short = Mask { data: vec![255; 47], width: 8, height: 6 };
        assert_eq!(refused(&short, 5), ("size-mismatch", vec![("expected", 48.0), ("actual", 47.0)]));
    }
}
