//! The whole way on a rendered scene, of which everything is known.
#![allow(clippy::unwrap_used)]

use std::borrow::Cow;
use std::cell::Cell;

use depthstitch::geometry::{Calibration, EstimateOptions, Match, ModelKind};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::observer::Observer;
use depthstitch::pipeline::{Options, Stitched, align, stitch, stitch_with_depth_sink};
use depthstitch::report::Warning;
use depthstitch::{InverseDepth, Rect, Stage};
use scene::{MatchOptions, Pair, Photos, Random, Scene, map_error, median};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);
const EXACT: MatchOptions = MatchOptions { count: 300, sigma: 0.0, outliers: 0.0, seed: 1 };
/// As a good detector finds them.
const NOISY: MatchOptions = MatchOptions { count: 300, sigma: 0.3, outliers: 0.1, seed: 1 };
/// Of two photos of the gallery alone with these a homography looks more natural than any surface, in spite of so much parallax.
const FLAT: MatchOptions = MatchOptions { sigma: 0.0, seed: 3, ..NOISY };

/// The published method, with our threshold.
fn published() -> Options {
    let estimate = EstimateOptions { calibration: Calibration::Off, ..EstimateOptions::default() };
    Options { estimate, ..Options::paper() }
}

fn render(scene: &Scene) -> Pair<'_> {
    scene.render(SIZE.0, SIZE.1)
}

fn run(photos: &Photos, options: &Options) -> Stitched {
    stitch(Some(&photos.matches), photos.target(), photos.reference(), options, &mut ()).unwrap()
}

fn codes(found: &Stitched) -> Vec<&'static str> {
    found.warnings.iter().map(|warning| warning.code()).collect()
}

fn inside([x, y]: [f64; 2], margin: f64) -> bool {
    let (w, h) = (SIZE.0 as f64 - 1.0, SIZE.1 as f64 - 1.0);
    x >= margin && y >= margin && x <= w - margin && y <= h - margin
}

/// Largest difference of red, green or blue.
fn colour_error(a: [u8; 4], b: [u8; 4]) -> u8 {
    (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
}

#[test]
fn exact_matches_give_the_true_map_back() {
    let scene = scene::gallery();
    let pair = render(&scene);
    let found = run(&Photos::of(&pair, &EXACT), &published());
    assert_ne!(found.geometry.kind, ModelKind::Homography);
    assert_eq!(codes(&found), [""; 0]);
    assert!(found.geometry.inliers.iter().all(|inlier| *inlier));
    for error in map_error(&found.geometry.forward, &pair) {
        assert!(error < 1e-3, "{error} px");
    }
    // Matches lie between the reference's pixels, where its depth is interpolated.
    let [forward, reverse] = found.geometry.residual;
    assert!(forward < 1e-3 && reverse < 0.05, "{forward} px forward, {reverse} px reverse");
}

#[test]
fn noise_and_outliers_leave_the_map_right_within_and_beyond_the_overlap() {
    let scene = scene::gallery();
    let pair = render(&scene);
    for seed in 1..=5 {
        let sampled = pair.matches(&MatchOptions { seed, ..NOISY });
        let photos = Photos { matches: sampled.matches, ..Photos::of(&pair, &NOISY) };
        let found = run(&photos, &published());
        assert_eq!(codes(&found), [""; 0], "seed {seed}");
        let [within, beyond] = map_error(&found.geometry.forward, &pair);
        assert!(within < 0.15 && beyond < 0.5, "seed {seed}: {within} px within, {beyond} px beyond");
        let wrong = found.geometry.inliers.iter().zip(&sampled.inliers).filter(|(found, truth)| found != truth).count();
        assert!(wrong <= 6, "seed {seed}: {wrong} flags of {} are wrong", sampled.inliers.len());
    }
}

/// What the target did not see stays empty, what it saw is drawn.
#[test]
fn voids_are_where_the_target_did_not_see() {
    let scene = scene::gallery();
    let pair = render(&scene);
    let found = run(&Photos::of(&pair, &NOISY), &published());
    let (canvas, (left, top)) = (found.warped.image.view(), found.warped.offset);
    let (mut hits, mut hidden, mut void, mut seen, mut total) = (0, 0, 0, 0, 0);
    let places = pair.reverse_map();
    for (i, visible) in pair.visible_in_target().into_iter().enumerate() {
        total += 1;
        // Within the target's frame: beyond it nothing is drawn anyway, which would flatter.
        if !places[i].is_some_and(|place| inside(place, 1.0)) {
            continue;
        }
        let empty = canvas.pixel(left + i % SIZE.0, top + i / SIZE.0)[3] == 0;
        hits += usize::from(empty && !visible);
        void += usize::from(empty);
        hidden += usize::from(!visible);
        seen += usize::from(visible);
    }
    let (precision, recall) = (hits as f64 / void as f64, hits as f64 / hidden as f64);
    println!("{hidden} hidden pixels, {void} voids: precision {precision:.3}, recall {recall:.3}");
    assert!(hidden > 500, "{hidden}");
    assert!(precision > 0.8 && recall > 0.7, "precision {precision}, recall {recall}");
    let expected = seen as f64 / total as f64;
    assert!((found.quality.coverage - expected).abs() < 0.04, "coverage {}, not {expected}", found.quality.coverage);
}

/// Reference alone: its very bytes. Both: the average, alike. Target alone: the target's colour at its true place.
#[test]
fn mosaic_pixels_are_right() {
    let scene = scene::gallery();
    let pair = render(&scene);
    let photos = Photos::of(&pair, &NOISY);
    let found = run(&photos, &published());
    let (left, top) = found.warped.offset;
    let (mosaic, warped) = (found.mosaic.image.view(), found.warped.image.view());
    let mut overlap = Vec::new();
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let [got, ours, theirs] =
                [mosaic.pixel(left + x, top + y), warped.pixel(left + x, top + y), photos.reference.view().pixel(x, y)];
            if ours[3] == 0 {
                assert_eq!(got, theirs, "({x}, {y})");
            } else {
                let mean = [0, 1, 2].map(|c| (u16::from(ours[c]) + u16::from(theirs[c])).div_ceil(2) as u8);
                assert_eq!(got, [mean[0], mean[1], mean[2], 255], "({x}, {y})");
                overlap.push(f64::from(colour_error(ours, theirs)));
            }
        }
    }
    let mut alone = Vec::new();
    for (i, place) in pair.map().into_iter().enumerate() {
        let Some([u, v]) = place.filter(|place| !inside(*place, -2.0)) else { continue };
        let (x, y) = ((u + left as f64).round(), (v + top as f64).round());
        if x < 0.0 || y < 0.0 || x >= mosaic.width() as f64 || y >= mosaic.height() as f64 {
            continue;
        }
        let got = mosaic.pixel(x as usize, y as usize);
        let expected = photos.target.view().pixel(i % SIZE.0, i / SIZE.0);
        alone.push(if got[3] == 0 { 255.0 } else { f64::from(colour_error(got, expected)) });
    }
    assert!(overlap.len() > 10_000 && alone.len() > 1000, "{} and {} pixels", overlap.len(), alone.len());
    let (overlap, alone) = (median(overlap), median(alone));
    assert!(overlap <= 8.0 && alone <= 20.0, "median colour errors {overlap} and {alone}");
    let left_empty =
        found.mosaic.voids.data().iter().zip(mosaic.pixels()).filter(|(v, p)| **v != 0 && p[3] == 0).count();
    assert!(10 * left_empty < found.mosaic.voids.count().max(1), "{left_empty} voids are not filled");
}

#[test]
fn depth_maps_of_another_scale_and_shift_change_nothing() {
    let scene = scene::gallery();
    let pair = render(&scene);
    let photos = Photos::of(&pair, &NOISY);
    let affine = |view: &scene::View, scale: f32, shift: f32| {
        let raw: Vec<f32> = view.inverse_depth().iter().map(|d| scale * d + shift).collect();
        InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).ok()
    };
    let relative = Photos {
        target_depth: affine(&pair.target, 200.0, 7.0),
        reference_depth: affine(&pair.reference, 31.0, -2.0),
        ..photos.clone()
    };
    let (metric, relative) = (run(&photos, &published()), run(&relative, &published()));
    assert_eq!(metric.geometry.inliers, relative.geometry.inliers);
    let difference = metric.quality.psnr_mask - relative.quality.psnr_mask;
    assert!(difference.abs() < 0.2, "{difference} dB");
}

#[test]
fn depth_beats_a_homography() {
    let scene = scene::gallery();
    let photos = Photos::of(&render(&scene), &NOISY);
    let flat = run(&Photos { target_depth: None, reference_depth: None, ..photos.clone() }, &published());
    let deep = run(&photos, &published());
    assert_eq!(flat.geometry.kind, ModelKind::Homography);
    assert!(
        deep.quality.ssim_mask > flat.quality.ssim_mask + 0.1,
        "{} {}",
        deep.quality.ssim_mask,
        flat.quality.ssim_mask
    );
}

#[test]
fn the_same_seed_gives_the_same_result_whatever_the_order_of_calls() {
    let scene = scene::gallery();
    let photos = Photos::of(&render(&scene), &NOISY);
    let first = run(&photos, &published());
    let reversed: Vec<Match> = photos.matches.iter().rev().copied().collect();
    run(&Photos { matches: reversed, ..photos.clone() }, &published());
    let again = run(&photos, &published());
    assert_eq!(again.geometry, first.geometry);
    assert!(again.mosaic == first.mosaic && again.warped.image == first.warped.image, "other pictures");
}

/// The same with depth as a network gives it: right on the whole, wrong by a few pixels of motion everywhere.
fn wavy(photos: &Photos) -> Photos {
    let wave = |i: usize| 0.06 * ((i % SIZE.0) as f32 / 40.0).sin() * ((i / SIZE.0) as f32 / 30.0).cos();
    let wavy = |map: &InverseDepth| {
        let raw: Vec<f32> = map.data().iter().enumerate().map(|(i, d)| d * (1.0 + wave(i))).collect();
        InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
    };
    let [target_depth, reference_depth] =
        [&photos.target_depth, &photos.reference_depth].map(|map| map.as_ref().map(wavy));
    Photos { target_depth, reference_depth, ..photos.clone() }
}

#[test]
fn our_own_way_corrects_the_depth_and_needs_none() {
    let scene = scene::gallery();
    let exact = Photos::of(&render(&scene), &NOISY);
    let biased = wavy(&exact);
    let plain = run(&biased, &published());
    let refined = run(&biased, &Options::default());
    let ssim = |found: &Stitched| found.quality.ssim_mask;
    assert!(ssim(&refined) > ssim(&plain) + 0.02, "{} {}", ssim(&refined), ssim(&plain));

    let none = Photos { target_depth: None, reference_depth: None, ..exact.clone() };
    let flat = run(&none, &published());
    let found = run(&none, &Options { refine: None, output_depth: true, ..Options::default() });
    assert_eq!(found.geometry.kind, ModelKind::TwoView);
    assert!(found.depth.iter().all(|map| map.is_some()));
    assert!(ssim(&found) > ssim(&flat) + 0.05, "{} {}", ssim(&found), ssim(&flat));
    // Where a homography looks more natural the report says that it was taken.
    let natural = Photos { target_depth: None, reference_depth: None, ..Photos::of(&render(&scene), &FLAT) };
    let natural = run(&natural, &Options::default());
    assert_eq!(natural.geometry.kind, ModelKind::Homography);
    assert!(natural.warnings.contains(&Warning::ParallaxIgnored));

    let one = Photos { reference_depth: None, ..exact };
    let derived = run(&one, &Options::default());
    assert!(matches!(derived.geometry.kind, ModelKind::Depth | ModelKind::Calibrated));
    assert!(ssim(&derived) > ssim(&flat) + 0.05, "{} {}", ssim(&derived), ssim(&flat));
}

/// Median distance, outside of the reference's frame, between where the target's pixels are put and where they belong.
fn error_outside(found: &Stitched, pair: &Pair<'_>) -> f64 {
    let depth = found.depth[0].as_ref().unwrap();
    let errors = pair.map().into_iter().enumerate().filter_map(|(i, place)| {
        let (place, at) = (place.filter(|place| !inside(*place, 0.0))?, [(i % SIZE.0) as f64, (i / SIZE.0) as f64]);
        let found = found.geometry.forward.project(at[0], at[1], depth.sample(at[0], at[1]))?;
        Some(scene::distance(found, place))
    });
    median(errors.collect())
}

/// A network's errors vary slowly over the photo: what stereo finds of them in the overlap tells of them beyond it.
#[test]
fn inexact_maps_are_corrected_outside_as_well() {
    let scene = scene::gallery();
    let pair = render(&scene);
    let photos = wavy(&Photos::of(&pair, &NOISY));
    let options = Options { output_depth: true, ..Options::default() };
    let found = run(&photos, &options);
    assert_eq!(found.geometry.comparison.map(|comparison| comparison.exact), Some(false));
    let given = run(&photos, &Options { refine: None, ..options });
    let [corrected, given] = [found, given].map(|found| error_outside(&found, &pair));
    assert!(corrected < 0.75 * given, "{corrected} {given}");
}

#[test]
fn crops_hold_nothing_empty_and_leave_nothing_out() {
    let scene = scene::gallery();
    let found = run(&Photos::of(&render(&scene), &NOISY), &Options::default());
    let (inner, bounds) = (found.crops.inner.unwrap(), found.crops.bounds.unwrap());
    let mosaic = found.mosaic.image.view();
    for y in 0..mosaic.height() {
        for x in 0..mosaic.width() {
            let within = |r: Rect| x >= r.x && y >= r.y && x < r.x + r.width && y < r.y + r.height;
            let valid = mosaic.pixel(x, y)[3] != 0;
            assert!(valid || !within(inner), "({x}, {y}) is empty");
            assert!(!valid || within(bounds), "({x}, {y}) is left out");
        }
    }
    assert!(inner.width >= SIZE.0 && inner.height >= SIZE.1, "{inner:?}");
}

/// A depth map that says nothing of the scene.
fn unusable(kind: &str, seed: u32) -> InverseDepth {
    let mut random = Random::new(seed.into());
    let value = |i: usize| match kind {
        "zero" => 0.0,
        "constant" => 0.7,
        "a ramp" => (i % SIZE.0) as f32 / SIZE.0 as f32,
        _ => random.uniform() as f32,
    };
    let raw: Vec<f32> = (0..SIZE.0 * SIZE.1).map(value).collect();
    InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
}

/// Depth maps that do not fit the photos, one or both, do no worse than none at all, and the result says so.
#[test]
fn unusable_depth_maps_do_no_worse_than_none() {
    let scene = scene::gallery();
    let photos = Photos::of(&render(&scene), &NOISY);
    let none = run(&Photos { target_depth: None, reference_depth: None, ..photos.clone() }, &Options::default());
    for kind in ["zero", "constant", "a ramp", "noise"] {
        for bad in [[true, false], [false, true], [true, true]] {
            let map = |side: usize, good: &Option<InverseDepth>| {
                if bad[side] { Some(unusable(kind, 1 + side as u32)) } else { good.clone() }
            };
            let given = Photos {
                target_depth: map(0, &photos.target_depth),
                reference_depth: map(1, &photos.reference_depth),
                ..photos.clone()
            };
            let found = run(&given, &Options::default());
            let name = format!("{kind}, target and reference {bad:?}");
            let [q, least] = [found.quality, none.quality];
            println!(
                "{name}: {:?}, {:.2} dB, SSIM {:.3}, coverage {:.3} against {:.2}, {:.3}, {:.3}; {:?}",
                found.geometry.kind,
                q.psnr_mask,
                q.ssim_mask,
                q.coverage,
                least.psnr_mask,
                least.ssim_mask,
                least.coverage,
                codes(&found)
            );
            assert!(codes(&found).contains(&"depth-inconsistent"), "{name}: {:?}", codes(&found));
            assert!(!codes(&found).contains(&"parallax-unobservable"), "{name}");
            assert!(q.ssim_mask > least.ssim_mask - 0.02 && q.coverage > least.coverage - 0.02, "{name}");
            assert!(q.psnr_mask > least.psnr_mask - 0.5, "{name}");
        }
    }
}

#[test]
fn good_depth_maps_are_not_ignored() {
    for scene in [scene::gallery(), scene::plane(), scene::rotation()] {
        let found = run(&Photos::of(&render(&scene), &NOISY), &Options::default());
        assert!(!codes(&found).contains(&"depth-inconsistent"), "{:?}", codes(&found));
    }
}

/// The stage that a call is in.
struct Current<'c>(&'c Cell<Stage>);

impl Observer for Current<'_> {
    fn progress(&mut self, stage: Stage, _: f32) -> bool {
        self.0.set(stage);
        true
    }
}

/// What filling needs of the reference's depth goes last.
#[test]
fn depth_is_given_away_as_soon_as_nothing_reads_it() {
    let exact = Photos::of(&render(&scene::gallery()), &NOISY);
    let flat = Photos::of(&render(&scene::gallery()), &FLAT);
    let none = Photos { target_depth: None, reference_depth: None, ..flat };
    let filled = Options { output_depth: true, ..Options::default() };
    let open = Options { fill: None, ..filled.clone() };
    let stage = Cell::new(Stage::Input);
    for (photos, options, last) in
        [(&exact, &filled, Some(Stage::Measure)), (&exact, &open, Some(Stage::Warp)), (&none, &filled, None)]
    {
        let kept = run(photos, options);
        let mut given = [None, None];
        let mut take = |side: usize, map: Cow<'_, InverseDepth>| given[side] = Some((map.into_owned(), stage.get()));
        let (matches, target, reference) = (Some(&photos.matches[..]), photos.target(), photos.reference());
        let mut stages = Current(&stage);
        let found = stitch_with_depth_sink(matches, target, reference, options, Some(&mut take), &mut stages).unwrap();
        assert_eq!(found.depth, [None, None]);
        assert_eq!(found.mosaic, kept.mosaic);
        let stages = given.each_ref().map(|map| map.as_ref().map(|(_, stage)| *stage));
        assert_eq!(stages, [last.map(|_| Stage::Warp), last]);
        assert_eq!(given.map(|map| map.map(|(map, _)| map)), kept.depth);
    }
}

/// Depth plays no part in a homography.
#[test]
fn a_homography_has_no_depth() {
    let options = Options { output_depth: true, ..Options::default() };
    for scene in [scene::plane(), scene::rotation()] {
        let photos = Photos::of(&render(&scene), &NOISY);
        let one = Photos { reference_depth: None, ..photos.clone() };
        let none = Photos { target_depth: None, ..one.clone() };
        for photos in [photos, one, none] {
            let found = run(&photos, &options);
            assert_eq!(found.geometry.kind, ModelKind::Homography);
            assert!(codes(&found).contains(&"parallax-unobservable"), "{:?}", codes(&found));
            assert!(!codes(&found).contains(&"no-depth"), "{:?}", codes(&found));
            assert_eq!(found.depth, [None, None]);
            let aligned = align(Some(&photos.matches), photos.target(), photos.reference(), &options, &mut ()).unwrap();
            assert_eq!(aligned.depth, [None, None]);
        }
    }
}
