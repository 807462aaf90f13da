//! Seam and blending of pictures made by formula.
#![allow(clippy::unwrap_used)]

mod pictures;

use depthstitch::geometry::Match;
use depthstitch::mosaic::{BlendOptions, Blending, Composition, Exposure, Layer, Mosaic, Seam, SeamGuide, blend};
use depthstitch::warp::Warped;
use depthstitch::{Error, Image, Mask, Result, Stage};
use pictures::{Watch, mask, picture, pixels, warped};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Smooth, with something to see everywhere.
fn texture(x: usize, y: usize) -> [u8; 3] {
    let wave = |a: usize, b: usize| (100 + (a * x + b * y) % 61 - (a * x * 7 + b * y * 3) % 23) as u8;
    [wave(3, 5), wave(7, 2), wave(1, 9)]
}

/// A canvas of 160×100 with the target where `valid`, and a reference of 100×100 on its right.
const CANVAS: (usize, usize) = (160, 100);
const LEFT: usize = 60;

fn stage(valid: impl Fn(usize, usize) -> bool, target: impl Fn(usize, usize) -> [u8; 3]) -> Warped {
    let image = picture(CANVAS.0, CANVAS.1, |x, y| {
        let [r, g, b] = target(x, y);
        // Colours under alpha 0 must not matter.
        if valid(x, y) { [r, g, b, 255] } else { [255, 0, (x * y) as u8, 0] }
    });
    warped(image, (LEFT, 0))
}

fn reference(pixel: impl Fn(usize, usize) -> [u8; 3]) -> Image {
    picture(CANVAS.0 - LEFT, CANVAS.1, |x, y| {
        let [r, g, b] = pixel(x + LEFT, y);
        [r, g, b, 255]
    })
}

/// The left 120 columns, less a few small holes.
fn overlapping(x: usize, y: usize) -> bool {
    x < 120 && !(x > 70 && x % 13 == 5 && y % 11 < 2)
}

fn compose(warped: &Warped, reference: &Image, options: &BlendOptions) -> Result<Mosaic> {
    blend(warped, reference.view(), &SeamGuide::default(), options, &mut ())
}

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

/// Whether the seam passes between two pixels of the region.
fn passes(seam: &Mask, inside: impl Fn(usize, usize) -> bool) -> bool {
    let differ = |a: usize, b: usize| seam.data()[a] ^ seam.data()[b] == 3;
    (0..seam.data().len()).any(|i| {
        let (x, y) = (i % seam.width(), i / seam.width());
        inside(x, y)
            && (x + 1 < seam.width() && inside(x + 1, y) && differ(i, i + 1)
                || y + 1 < seam.height() && inside(x, y + 1) && differ(i, i + seam.width()))
    })
}

#[test]
fn the_seam_avoids_what_moved_and_what_is_unreliable() {
    let options = BlendOptions { exposure: Exposure::Off, ..BlendOptions::default() };
    // A bar across most of the overlap, so that the shortest way would lead through it.
    for bar in [10..80, 25..100, 0..70] {
        let moved = |x: usize, y: usize| (66..112).contains(&x) && bar.contains(&y);
        let bright = |x: usize, y: usize| if moved(x, y) && (x + y) % 7 < 4 { [250, 250, 20] } else { texture(x, y) };
        let mosaic = compose(&stage(|x, _| x < 120, bright), &reference(texture), &options).unwrap();
        assert!(!passes(&mosaic.seam, moved), "the seam crosses what moved in {bar:?}");

        let reliable = mask(100, 100, |x, y| !moved(x + LEFT, y));
        let (warped, other) = (stage(|x, _| x < 120, texture), reference(texture));
        let mosaic =
            blend(&warped, other.view(), &SeamGuide { reliable: Some(&reliable), matches: &[] }, &options, &mut ())
                .unwrap();
        assert!(!passes(&mosaic.seam, moved), "the seam crosses what is unreliable in {bar:?}");
    }
}

#[test]
fn the_seam_rather_goes_a_long_way_round_an_object_than_a_short_one_through_it() {
    // Two bars in the target, the upper one open on the left and the lower one on the right, and a little noise elsewhere.
    let upper = |x: usize, y: usize| (30..34).contains(&y) && !(66..76).contains(&x);
    let lower = |x: usize, y: usize| (64..68).contains(&y) && !(104..114).contains(&x);
    let bar = move |x: usize, y: usize| upper(x, y) || lower(x, y);
    let target = |x: usize, y: usize| if bar(x, y) { [250; 3] } else { [140 + 8 * ((x + y) % 2) as u8; 3] };
    let warped = stage(|x, _| x < 120, target);
    let found =
        compose(&warped, &reference(|_, _| [132; 3]), &BlendOptions { exposure: Exposure::Off, ..Default::default() });
    // Bars reach the photos' borders, next to which there is nothing to decide.
    let inner = |x: usize| (64..116).contains(&x);
    assert!(!passes(&found.unwrap().seam, |x, y| bar(x, y) && inner(x)));
}

#[test]
fn the_seam_avoids_edges_even_where_the_photos_agree() {
    // An upright edge in the middle of the overlap, around which alone both are the same.
    let edge = |x: usize| if x < 90 { 100 } else { 160 };
    let target = |x: usize, _: usize| [if (86..94).contains(&x) { edge(x) } else { edge(x) + 4 }; 3];
    let warped = stage(|x, _| x < 120, target);
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &reference(|x, _| [edge(x); 3]), &options).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| (88..92).contains(&x)), "the seam runs along the edge");
}

/// The reference is not distorted: what looks different in the target is shown by the reference, although the target would agree a little
/// better with it on the other side.
#[test]
fn the_reference_shows_what_looks_different() {
    let target = |x: usize, _: usize| match x {
        ..84 => [134; 3],
        84..108 => [200; 3],
        _ => [132; 3],
    };
    let warped = stage(|x, _| x < 120, target);
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &reference(|_, _| [132; 3]), &options).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| x > 84), "the seam is behind what looks different");
}

/// A tower that leans in the target, which covers all of the reference and differs from it by a little everywhere: without any seam it
/// would be the target's.
#[test]
fn the_reference_shows_what_leans_though_the_target_covers_it() {
    let tower = |x: usize, y: usize| (100..112).contains(&x) && (24..76).contains(&y);
    let leaning = |x: usize, y: usize| if tower(x - y.saturating_sub(24) / 5, y) { [60; 3] } else { [203; 3] };
    let warped = stage(|_, _| true, |x, y| if x > 20 { leaning(x, y) } else { [203; 3] });
    let other = reference(|x, y| if tower(x, y) { [60; 3] } else { [200; 3] });
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &other, &options).unwrap();
    // The same of a set of photos, whose labels are the target's and the reference's of two.
    let mut set = Composition::of(other.view(), None, 2).unwrap();
    set.add(&warped, [0, 0], Layer { label: 1, gains: None, matches: &[] }, &options, &mut ()).unwrap();
    for labels in [&mosaic.seam, &set.labels] {
        let shown = (0..CANVAS.0 * CANVAS.1).filter(|i| tower(i % CANVAS.0, i / CANVAS.0)).map(|i| labels.data()[i]);
        assert_eq!(shown.filter(|label| *label != 2).count(), 0, "the target shows of the tower");
    }
}

/// A sign that the photos show 30 pixels apart, with nothing between its two places that would keep the seam from passing there: it would be seen
/// twice, or not at all.
#[test]
fn what_the_photos_show_at_two_places_is_seen_once() {
    let options = BlendOptions { exposure: Exposure::Off, seam: Seam::Cut, ..Default::default() };
    for [own, other] in [[70, 100], [100, 70]] {
        let sign = |left: usize, x: usize, y: usize| (left..left + 10).contains(&x) && (30..70).contains(&y);
        let target = |x: usize, y: usize| match x {
            _ if sign(own, x, y) => [90, 30, 120],
            82..98 => [140; 3],
            _ => [146; 3],
        };
        let warped = stage(|x, _| x < 120, target);
        let reference = reference(|x, y| if sign(other, x, y) { [90, 30, 120] } else { [140; 3] });
        let place = |left: usize, y: f64| [left as f64 + 4.5, y];
        let match_at = |y: usize| Match { target: place(own, y as f64), reference: place(other, y as f64) };
        let matches: Vec<Match> = (30..70).step_by(3).map(match_at).collect();
        let seen = |labels: &Mask| {
            let shows = |left: usize, label: u8| {
                (0..CANVAS.0 * CANVAS.1)
                    .filter(|i| sign(left, i % CANVAS.0, i / CANVAS.0))
                    .all(|i| labels.data()[i] == label)
            };
            usize::from(shows(own, 1)) + usize::from(shows(other, 2))
        };
        let mosaic = |matches| {
            let guide = SeamGuide { reliable: None, matches };
            blend(&warped, reference.view(), &guide, &options, &mut ()).unwrap()
        };
        assert_ne!(seen(&mosaic(&[]).seam), 1, "the seam goes round by itself");
        assert_eq!(seen(&mosaic(&matches).seam), 1, "with {own} and {other}");

        // The same of a set of photos, where places are in pixels of the reference's view.
        let in_view = |[x, y]: [f64; 2]| [x - LEFT as f64, y];
        let labelled = |label: u8| -> Vec<(Match, u8)> {
            let place = |m: &Match| Match { target: in_view(m.target), reference: in_view(m.reference) };
            matches.iter().map(|m| (place(m), label)).collect()
        };
        let set = |matches: &[(Match, u8)]| {
            let mut set = Composition::of(reference.view(), None, 2).unwrap();
            set.add(&warped, [0, 0], Layer { label: 1, gains: None, matches }, &options, &mut ()).unwrap();
            set
        };
        assert_eq!(seen(&set(&labelled(2)).labels), 1, "of a set, with {own} and {other}");
        // Another photo's matches say nothing of what this one shows.
        assert_eq!(set(&labelled(3)).labels, set(&[]).labels);
    }
}

/// A confidence of 0 where `unreliable`.
fn unreliable_where(warped: Warped, unreliable: impl Fn(usize, usize) -> bool) -> Warped {
    Warped { confidence: Some(mask(CANVAS.0, CANVAS.1, |x, y| !unreliable(x, y))), ..warped }
}

/// The band along the reference's border that void recovery would take out: the seam passes behind it, and through it where the
/// photos look alike.
#[test]
fn an_unreliable_band_does_not_hold_the_seam_at_the_border() {
    let band = |x: usize, _: usize| (LEFT..LEFT + 12).contains(&x);
    let warped = unreliable_where(stage(|x, _| x < 120, texture), band);
    let mosaic = compose(&warped, &reference(texture), &BlendOptions::default()).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| x < LEFT + 4), "the seam is at the border");
}

/// What is unreliable and looks unlike the reference is not shown where the reference reaches.
#[test]
fn the_reference_shows_where_the_target_is_unreliable() {
    let torn = |x: usize, y: usize| (70..110).contains(&x) && (30..70).contains(&y);
    let target = |x: usize, y: usize| if torn(x, y) { [250, 30, 20] } else { texture(x, y) };
    let warped = unreliable_where(stage(|x, _| x < 120, target), torn);
    let mosaic = compose(&warped, &reference(texture), &BlendOptions::default()).unwrap();
    let shown = (0..CANVAS.0 * CANVAS.1).filter(|i| torn(i % CANVAS.0, i / CANVAS.0) && mosaic.seam.data()[*i] == 1);
    assert!(shown.count() < 40, "the target shows where it is torn");
}

/// Patches in which the photos agree here and there make no islands.
#[test]
fn there_are_no_small_islands() {
    let differ = |x: usize, y: usize| (x / 5 + y / 5).is_multiple_of(2);
    let target = |x: usize, y: usize| texture(x, y).map(|v| if differ(x, y) { v + 60 } else { v });
    let mosaic = compose(&stage(|x, _| x < 120, target), &reference(texture), &BlendOptions::default()).unwrap();
    let seam = mosaic.seam.data();
    let mut seen = vec![false; seam.len()];
    let mut regions = 0;
    for first in 0..seam.len() {
        let mut open = vec![first];
        regions += usize::from(!seen[first]);
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut seen[at], true) {
                continue;
            }
            let (x, y) = (at % CANVAS.0, at / CANVAS.0);
            let mut visit = |there: bool, other: usize| {
                if there && seam[other] == seam[at] && !seen[other] {
                    open.push(other);
                }
            };
            visit(x > 0, at.wrapping_sub(1));
            visit(x + 1 < CANVAS.0, at + 1);
            visit(y > 0, at.wrapping_sub(CANVAS.0));
            visit(y + 1 < CANVAS.1, at + CANVAS.0);
        }
    }
    assert_eq!(regions, 2);
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
