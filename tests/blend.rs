//! Blending of pictures made by formula.
#![allow(clippy::unwrap_used)]

mod pictures;

use depthstitch::mosaic::{BlendOptions, Blending, Exposure, Mosaic, Seam, SeamGuide, blend};
use depthstitch::{Error, Mask, Stage};
use pictures::overlap::{CANVAS, LEFT, compose, overlapping, reference, stage, texture};
use pictures::{Watch, picture, pixels, warped};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn ways() -> Vec<BlendOptions> {
    let mut all = Vec::new();
    for exposure in [Exposure::Off, Exposure::Gain, Exposure::Field] {
        for seam in [Seam::Off, Seam::Cut, Seam::Aligned] {
            for blending in [Blending::Average, Blending::Feather, Blending::Multiband] {
                all.push(BlendOptions { exposure, seam, blending, ..BlendOptions::default() });
            }
        }
    }
    all
}

#[test]
fn photos_that_agree_come_out_as_they_are() {
    let (warped, other) = (stage(overlapping, texture), reference(texture));
    for options in ways() {
        let mosaic = compose(&warped, &other, &options).unwrap();
        assert!(mosaic.gains.iter().all(|gain| (gain - 1.0).abs() < 1e-6), "{options:?}: {:?}", mosaic.gains);
        for (i, pixel) in pixels(&mosaic.image).iter().enumerate() {
            let (x, y) = (i % CANVAS.0, i / CANVAS.0);
            let [r, g, b] = texture(x, y);
            assert_eq!(*pixel, [r, g, b, 255], "at {x}, {y} with {options:?}");
            let shown = mosaic.seam.data()[i];
            let possible = [overlapping(x, y), x >= LEFT];
            match shown {
                1 => assert!(possible[0]),
                2 => assert!(possible[1]),
                _ => assert!(shown == 3 && possible[0] && possible[1] && options.blending == Blending::Average),
            }
        }
    }
}

/// A brighter target: between the two levels everywhere, unchanged away from the seam, and no jump at it.
#[test]
fn bands_pass_smoothly_and_leave_no_halo() {
    let (warped, other) = (stage(overlapping, |_, _| [140, 140, 140]), reference(|_, _| [100, 100, 100]));
    for seam in [Seam::Off, Seam::Cut, Seam::Aligned] {
        let options = BlendOptions { exposure: Exposure::Off, seam, bands: 4, ..BlendOptions::default() };
        let mosaic = compose(&warped, &other, &options).unwrap();
        let level = |x: usize, y: usize| pixels(&mosaic.image)[y * CANVAS.0 + x][0];
        for y in 0..CANVAS.1 {
            assert_eq!((level(0, y), level(CANVAS.0 - 1, y)), (140, 100));
            for x in 0..CANVAS.0 {
                assert!((100..=140).contains(&level(x, y)), "{} at {x}, {y} with {seam:?}", level(x, y));
                if x > 0 {
                    let step = level(x, y).abs_diff(level(x - 1, y));
                    assert!(step <= 4, "a step of {step} at {x}, {y} with {seam:?}");
                }
            }
        }
        assert!(level(0, 0) == 140 && level(40, 50) >= 136 && level(130, 50) <= 104);
    }
}

/// Slanted bars, that many pixels lower in the target.
fn bars(lower: f64) -> impl Fn(usize, usize) -> [u8; 3] {
    move |x, y| {
        let wave = (0.35 * (y as f64 - lower) + 0.1 * x as f64).sin();
        [(128.0 + 90.0 * wave) as u8; 3]
    }
}

/// Mean difference of the mosaic from the reference's bars in the pixels of the target next to the seam.
fn apart(mosaic: &Mosaic) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (x, y) in (5..CANVAS.1 - 5).flat_map(|y| (LEFT..CANVAS.0 - 1).map(move |x| (x, y))) {
        let at = y * CANVAS.0 + x;
        if mosaic.seam.data()[at..at + 2] == [1, 2] {
            sum += f64::from(pixels(&mosaic.image)[at][0].abs_diff(bars(0.0)(x, y)[0]));
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

#[test]
fn target_gives_way_so_that_lines_go_on_across_the_seam() {
    let other = reference(bars(0.0));
    for lower in [-2.5, 1.5, 2.5] {
        let warped = stage(|x, _| x < 120, bars(lower));
        let with = |seam| {
            let options = BlendOptions { exposure: Exposure::Off, seam, bands: 1, ..BlendOptions::default() };
            compose(&warped, &other, &options).unwrap()
        };
        let (cut, aligned) = (with(Seam::Cut), with(Seam::Aligned));
        assert_eq!(aligned.seam, cut.seam);
        assert!(apart(&aligned) < 0.1 * apart(&cut), "{} {}", apart(&aligned), apart(&cut));
        // The reference stays as it is, and so does what is far from the seam.
        let changed = |x: usize| {
            (0..CANVAS.1).any(|y| aligned.image.pixels()[y * CANVAS.0 + x] != cut.image.pixels()[y * CANVAS.0 + x])
        };
        assert!((125..CANVAS.0).all(|x| !changed(x)));
        assert!((0..20).all(|x| !changed(x)));
    }
}

#[test]
fn photos_that_agree_are_not_moved() {
    let (warped, other) = (stage(overlapping, texture), reference(texture));
    let with = |seam| {
        let options = BlendOptions { exposure: Exposure::Off, seam, ..BlendOptions::default() };
        compose(&warped, &other, &options).unwrap()
    };
    assert_eq!(with(Seam::Aligned), with(Seam::Cut));
}

/// Half the ramp on either side of the middle line, 0 for a hard edge.
#[test]
fn feather_is_as_wide_as_asked_for() {
    let (warped, other) = (stage(|x, _| x < 120, |_, _| [200, 200, 200]), reference(|_, _| [100, 100, 100]));
    for feather in [0, 8, 20] {
        let options = BlendOptions {
            exposure: Exposure::Off,
            seam: Seam::Off,
            blending: Blending::Feather,
            feather,
            ..BlendOptions::default()
        };
        let mosaic = compose(&warped, &other, &options).unwrap();
        let row: Vec<u8> = pixels(&mosaic.image)[50 * CANVAS.0..51 * CANVAS.0].iter().map(|p| p[0]).collect();
        assert!(row.is_sorted_by(|a, b| a >= b), "{row:?}");
        let mixed = row.iter().filter(|&&v| v != 200 && v != 100).count();
        assert!(mixed.abs_diff(feather as usize) <= 1, "{mixed} mixed pixels of {feather}");
        assert_eq!((row[89 - feather as usize / 2], row[91 + feather as usize / 2]), (200, 100));
    }
}

#[test]
fn the_reference_is_changed_only_near_the_seam() {
    let dim = |x: usize, y: usize| texture(x, y).map(|v| v / 2);
    let (warped, other) = (stage(overlapping, dim), reference(texture));
    let options = BlendOptions { bands: 1, ..BlendOptions::default() };
    let mosaic = compose(&warped, &other, &options).unwrap();
    assert!(mosaic.gains.iter().all(|gain| *gain > 3.0), "{:?}", mosaic.gains);
    for (i, pixel) in pixels(&mosaic.image).iter().enumerate().filter(|(i, _)| i % CANVAS.0 >= 130) {
        let [r, g, b] = texture(i % CANVAS.0, i / CANVAS.0);
        assert_eq!(*pixel, [r, g, b, 255]);
    }
}

/// No overlap, nothing but overlap, no target, slivers: whatever is asked for, something sensible comes out.
#[test]
fn odd_shapes_are_no_trouble() {
    let masks: [fn(usize, usize) -> bool; 8] = [
        |x, _| x < LEFT,
        |_, _| true,
        |_, _| false,
        |x, y| x == 70 && y == 30,
        |x, _| x == LEFT,
        |x, y| (x + y) % 2 == 0,
        |x, y| x > 100 && y > 90,
        |x, y| x < LEFT - 20 || (x > 140 && y < 10),
    ];
    for (which, valid) in masks.into_iter().enumerate() {
        let (warped, other) = (stage(valid, |x, y| [x as u8, y as u8, 77]), reference(texture));
        for options in ways() {
            let mosaic = compose(&warped, &other, &options).unwrap();
            for (i, pixel) in pixels(&mosaic.image).iter().enumerate() {
                let (x, y) = (i % CANVAS.0, i / CANVAS.0);
                let covered = valid(x, y) || x >= LEFT;
                assert_eq!(pixel[3] == 255, covered, "mask {which} at {x}, {y} with {options:?}");
                assert_eq!(mosaic.seam.data()[i] != 0, covered);
                if !covered {
                    assert_eq!(*pixel, [0; 4]);
                }
            }
        }
    }
    let dot = picture(1, 1, |_, _| [9, 9, 9, 255]);
    let tiny = warped(dot.clone(), (0, 0));
    for options in ways() {
        assert_eq!(compose(&tiny, &dot, &options).unwrap().image, dot);
    }
}

#[test]
fn reports_progress_and_can_be_stopped() {
    let (warped, other) = (stage(overlapping, texture), reference(|x, y| texture(x + 1, y)));
    for options in ways() {
        let mut watch = Watch::new(Stage::Blend);
        blend(&warped, other.view(), &SeamGuide::default(), &options, &mut watch).unwrap();
        assert!(watch.seen.is_sorted(), "{options:?}: {:?}", watch.seen);
        assert_eq!((watch.seen.first(), watch.seen.last()), (Some(&0.0), Some(&1.0)));
        for limit in [0.0, 0.1, 0.3, 0.7] {
            let mut watch = Watch::until(Stage::Blend, limit);
            let stopped = blend(&warped, other.view(), &SeamGuide::default(), &options, &mut watch);
            assert_eq!(stopped, Err(Error::Aborted.into()), "{options:?} at {limit}");
        }
    }
}

#[test]
fn refuses_bad_options_and_sizes() {
    let (warped, other) = (stage(overlapping, texture), reference(texture));
    let refused = |options: &BlendOptions, reliable: Option<&Mask>| {
        let guide = SeamGuide { reliable, matches: &[] };
        let error = blend(&warped, other.view(), &guide, options, &mut ()).unwrap_err();
        (error.code(), error.details())
    };
    let feather = BlendOptions { feather: 1001, ..BlendOptions::default() };
    assert_eq!(refused(&feather, None), ("invalid-argument", vec![("value", 1001.0)]));
    let bands = BlendOptions { bands: 11, ..BlendOptions::default() };
    assert_eq!(refused(&bands, None), ("invalid-argument", vec![("value", 11.0)]));
    let small = Mask::new(vec![255; 99 * 100], 99, 100).unwrap();
    let sizes = vec![("width", 99.0), ("height", 100.0), ("expectedWidth", 100.0), ("expectedHeight", 100.0)];
    let mismatch = ("size-mismatch", sizes);
    assert_eq!(refused(&BlendOptions::default(), Some(&small)), mismatch);
}
