//! The robust fit on scenes whose geometry is known, and on tables of matches that determine none.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use depthstitch::geometry::{
    Calibration, EstimateOptions, Frame, Match, Model, ModelKind, RobustFit, Threshold, estimate,
};
use depthstitch::observer::Observer;
use depthstitch::report::Warning;
use depthstitch::{Error, InverseDepth, Stage};
use fingerprint::fingerprint;
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod fingerprint;
mod points;

use points::*;

/// Turns of some degrees, steps of up to a fifth of the nearest depth.
fn poses() -> impl Strategy<Value = ([f64; 3], [f64; 3], f64, u64)> {
    let angle = -0.08..0.08;
    let step = prop_oneof![-0.4..-0.1, 0.1..0.4];
    (
        [angle.clone(), angle.clone(), angle],
        (step.clone(), step, -0.2..0.2).prop_map(|(x, y, z)| [x, y, z]),
        250.0..600.0,
        any::<u64>(),
    )
}

/// Free models only.
fn free() -> EstimateOptions {
    EstimateOptions { calibration: Calibration::Off, ..Default::default() }
}

fn both_free() -> [EstimateOptions; 2] {
    both_thresholds().map(|options| EstimateOptions { calibration: Calibration::Off, ..options })
}

#[test]
fn recovers_exact_matches() {
    runner(24)
        .run(&poses(), |(angles, translation, focal, seed)| {
            let scene = Scene::new(angles, translation, focal, cloud, seed);
            prop_assume!(scene.matches.len() >= 40);
            for options in both_free() {
                let found = scene.fit(&options).unwrap();
                prop_assert_eq!(found.kind, ModelKind::Depth);
                prop_assert!(found.inliers.iter().all(|f| *f));
                // The inverse depths are rounded to single precision.
                prop_assert!(scene.error(&found.forward) < 1e-3, "{}", scene.error(&found.forward));
                prop_assert!(found.residual[0] < 1e-4 && found.residual[1] < 1e-3, "{:?}", found.residual);
                prop_assert!(found.warnings.is_empty());
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn recovers_noisy_matches_with_outliers() {
    runner(24)
        .run(&(poses(), 0.0..0.4), |((angles, translation, focal, seed), wrong)| {
            let exact = Scene::new(angles, translation, focal, cloud, seed);
            let scene = exact.clone().disturbed(0.4, wrong, seed ^ 1);
            prop_assume!(scene.matches.len() >= 60);
            let found = scene.fit(&EstimateOptions::default()).unwrap();
            prop_assert_ne!(found.kind, ModelKind::Homography);
            prop_assert!(scene.error(&found.forward) < 1.0, "{}", scene.error(&found.forward));
            // Right matches are inliers, wrong ones are not unless chance put them close.
            for ((m, m0), flag) in scene.matches.iter().zip(&exact.matches).zip(&found.inliers) {
                let [du, dv] = [m.reference[0] - m0.reference[0], m.reference[1] - m0.reference[1]];
                let moved = (du * du + dv * dv).sqrt();
                prop_assert!(moved > 2.0 || *flag);
                prop_assert!(moved < 4.0 || !*flag);
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn results_hardly_depend_on_the_seed_and_repeat() {
    let scene = Scene::new([0.03, -0.02, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 5).disturbed(0.4, 0.3, 6);
    let with = |seed| scene.fit(&EstimateOptions { seed, ..Default::default() }).unwrap();
    assert_eq!(with(1), with(1));
    for seed in 2..10 {
        let found = with(seed);
        assert_eq!(found.inliers, with(1).inliers);
        assert!((scene.error(&found.forward) - scene.error(&with(1).forward)).abs() < 1e-3);
    }
}

#[test]
fn affine_change_of_depth_leaves_the_map() {
    let scale = prop_oneof![0.01..0.5, 2.0..100.0, -3.0..-0.5];
    runner(24)
        .run(&(poses(), scale, -1.0..1.0), |((angles, translation, focal, seed), scale, shift)| {
            let scene = Scene::new(angles, translation, focal, cloud, seed).disturbed(0.2, 0.2, seed ^ 2);
            prop_assume!(scene.matches.len() >= 60);
            let changed = Scene {
                depth: scene
                    .depth
                    .clone()
                    .map(|map| map.iter().map(|d| (scale * f64::from(*d) + shift * scale) as f32).collect()),
                ..scene.clone()
            };
            let options = free();
            let (before, after) = (scene.fit(&options).unwrap(), changed.fit(&options).unwrap());
            for m in &scene.matches {
                let [x, y] = m.target;
                let at = y as usize * WIDTH + x as usize;
                let [a, b] = before.forward.project(x, y, f64::from(scene.depth[0][at])).unwrap();
                let [u, v] = after.forward.project(x, y, f64::from(changed.depth[0][at])).unwrap();
                prop_assert!((a - u).abs() < 1e-2 && (b - v).abs() < 1e-2);
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn third_coordinate_is_positive_in_front() {
    let scene = Scene::new([0.02, 0.04, -0.06], [-0.3, 0.2, -0.2], 350.0, cloud, 9);
    let found = scene.fit(&EstimateOptions::default()).unwrap();
    for m in &scene.matches {
        let d = f64::from(scene.depth[0][m.target[1] as usize * WIDTH + m.target[0] as usize]);
        assert!(found.forward.transform(m.target[0], m.target[1], d)[2] > 0.0);
    }
}

#[test]
fn no_parallax_gives_the_homography() {
    let turn = ([0.05, -0.06, 0.04], [0.0; 3]);
    let step = ([0.02, 0.03, -0.02], [0.3, 0.2, 0.1]);
    // What, pose, surface: a pure rotation, a flat scene, one depth.
    let cases: [(&str, _, Surface); 3] =
        [("rotation", turn, cloud), ("plane", step, plane), ("constant", step, constant)];
    for (what, (angles, translation), surface) in cases {
        for (sigma, wrong) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.3), (1.0, 0.1)] {
            for seed in 1..6 {
                let scene = Scene::new(angles, translation, 400.0, surface, seed).disturbed(sigma, wrong, seed + 100);
                let found = scene.fit(&EstimateOptions::default()).unwrap();
                assert_eq!(found.kind, ModelKind::Homography, "{what} σ {sigma} wrong {wrong} seed {seed}");
                assert_eq!(found.forward.e, Vector3::zeros());
                assert_eq!(found.reverse.e, Vector3::zeros());
                assert!(found.warnings.contains(&Warning::ParallaxUnobservable));
                assert!(scene.error(&found.forward) < 0.01 + 1.5 * sigma, "{what} {}", scene.error(&found.forward));
            }
        }
    }
}

#[test]
fn noisy_depth_of_a_plane_is_no_parallax() {
    let mut scene = Scene::new([0.02, 0.03, -0.02], [0.3, 0.2, 0.1], 400.0, plane, 3).disturbed(0.3, 0.2, 4);
    let mut noise = Noise(8);
    scene.depth = scene.depth.map(|map| map.iter().map(|d| d + 0.02 * noise.normal() as f32).collect());
    let found = scene.fit(&EstimateOptions::default()).unwrap();
    assert_eq!(found.kind, ModelKind::Homography);
    assert!(found.warnings.contains(&Warning::ParallaxUnobservable));
}

/// A homography is exact on the wall, where most matches are; its depth errs by up to a tenth and the rest's
/// by a fifth, as that of a single photo does.
#[test]
fn biased_depth_of_what_stands_before_a_wall_is_parallax() {
    let wall: Surface = |x, y, noise| if y < 130.0 { 0.2 + 0.0003 * x } else { 0.35 + 0.1 * noise.even() };
    for seed in 1..11 {
        let mut scene = Scene::new([0.02, 0.03, -0.02], [0.3, 0.2, 0.1], 400.0, wall, seed).disturbed(0.2, 0.3, seed);
        for map in &mut scene.depth {
            for (at, d) in map.iter_mut().enumerate() {
                let (x, y) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
                let most = if *d < 0.3 { 0.1 } else { 0.2 };
                *d *= (1.0 + most * libm::sin(x / 40.0 + seed as f64) * libm::cos(y / 30.0)) as f32;
            }
        }
        let found = scene.fit(&EstimateOptions::default()).unwrap();
        assert_ne!(found.kind, ModelKind::Homography, "seed {seed}");
        assert!(!found.warnings.contains(&Warning::ParallaxUnobservable));
    }
}

#[test]
fn few_matches() {
    let scene = Scene::new([0.03, -0.02, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 11);
    // Spread over the picture.
    let some = |n: usize| -> Vec<Match> { (0..n).map(|i| scene.matches[(i * 37 + 3) % scene.matches.len()]).collect() };
    let depth = Some([&scene.depth[0][..], &scene.depth[1][..]]);
    for options in both_free() {
        for n in 0..4 {
            let expected = Error::TooFewMatches { matches: n, usable: n, needed: 4 };
            assert_eq!(fit(&some(n), depth, &options), Err(expected));
        }
        let found = fit(&some(4), depth, &options).unwrap();
        assert_eq!(found.kind, ModelKind::Homography);
        assert_eq!(codes(&found), ["depth-unusable", "few-inliers"]);
        // Five exact matches with parallax need not agree on one homography.
        match fit(&some(5), depth, &options) {
            Ok(found) => assert!(codes(&found).contains(&"few-inliers")),
            Err(error) => assert!(matches!(error, Error::NoConsensus { matches: 5, .. })),
        }
        for n in [6, 7, 8, 12] {
            let found = fit(&some(n), depth, &options).unwrap();
            assert_eq!((found.kind, found.usable), (ModelKind::Depth, n));
            assert_eq!(codes(&found), ["few-inliers"]);
            assert!(found.residual[0] < 1e-3, "{n}: {:?}", found.residual);
        }
    }
}

#[test]
fn degenerate_places() {
    let depth = vec![0.5f32; WIDTH * HEIGHT];
    let maps = Some([&depth[..], &depth[..]]);
    let at = |p: [f64; 2]| Match { target: p, reference: [p[0] + 3.0, p[1] + 1.0] };
    let point: Vec<Match> =
        (0..50).map(|i| at([100.0 + 1e-4 * f64::from(i), 80.0 + 1e-5 * f64::from(i * i)])).collect();
    let line: Vec<Match> = (0..50).map(|i| at([10.0 + 4.0 * f64::from(i), 20.0 + 2.0 * f64::from(i)])).collect();
    for matches in [point, line] {
        for depth in [maps, None] {
            match fit(&matches, depth, &EstimateOptions::default()) {
                Err(Error::DegenerateGeometry { matches: 50, deviation }) => assert!(deviation < 0.1),
                other => panic!("{other:?}"),
            }
        }
    }
    // The same match again and again is one match.
    let repeated = [at([50.0, 60.0]); 30];
    let expected = Error::TooFewMatches { matches: 30, usable: 1, needed: 4 };
    assert_eq!(fit(&repeated, maps, &EstimateOptions::default()), Err(expected));
}

#[test]
fn unusable_matches_are_left_out() {
    let mut scene = Scene::new([0.03, -0.02, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 21);
    let good = scene.matches.len();
    let clean = scene.fit(&EstimateOptions::default()).unwrap();
    let first = scene.matches[0];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.6, 1e300] {
        scene.matches.push(Match { target: [bad, 5.0], reference: [5.0, 5.0] });
        scene.matches.push(Match { target: [5.0, 5.0], reference: [5.0, bad] });
    }
    scene.matches.push(Match { target: first.target, reference: [300.0, 200.0] });
    scene.matches.push(Match { target: [300.0, 200.0], reference: first.reference });
    let found = scene.fit(&EstimateOptions::default()).unwrap();
    assert_eq!(found.usable, good);
    assert_eq!(found.inliers.len(), good + 12);
    assert!(found.inliers[good..].iter().all(|f| !f));
    assert_eq!(found.forward, clean.forward);
}

#[test]
fn depth_full_of_holes() {
    let scene = Scene::new([0.05, -0.06, 0.04], [0.0; 3], 400.0, cloud, 31).disturbed(0.2, 0.1, 32);
    let holes = vec![f32::NAN; WIDTH * HEIGHT];
    for depth in [[&holes[..], &holes[..]], [&scene.depth[0], &holes], [&holes, &scene.depth[1]]] {
        let found = fit(&scene.matches, Some(depth), &EstimateOptions::default()).unwrap();
        assert_eq!(found.kind, ModelKind::Homography);
        assert_eq!(found.usable, scene.matches.len());
        assert_eq!(codes(&found), ["depth-unusable"]);
    }
    let found = fit(&scene.matches, None, &EstimateOptions::default()).unwrap();
    assert_eq!((found.kind, codes(&found)), (ModelKind::Homography, vec!["no-depth"]));
}

#[test]
fn different_scenes_do_not_agree() {
    for (n, seeds) in [(20, 40), (60, 40), (400, 6)] {
        for seed in 0..seeds {
            let mut noise = Noise(seed * 1000 + n);
            let mut place = || [160.0 + 158.0 * noise.even(), 120.0 + 118.0 * noise.even()];
            let matches: Vec<Match> = (0..n).map(|_| Match { target: place(), reference: place() }).collect();
            let mut noise = Noise(seed);
            let mut map = || -> Vec<f32> { (0..WIDTH * HEIGHT).map(|_| 0.3 + 0.2 * noise.even() as f32).collect() };
            let (a, b) = (map(), map());
            for options in both_thresholds() {
                match fit(&matches, Some([&a, &b]), &options) {
                    Err(Error::NoConsensus { matches, inliers, needed }) => {
                        assert_eq!(matches, n as usize);
                        assert!(inliers < needed && needed <= n as usize);
                    }
                    other => panic!("{n} random matches, seed {seed}: {other:?}"),
                }
            }
        }
    }
}

/// Three layers, one after the other.
fn layers(x: f64, _: f64, _: &mut Noise) -> f64 {
    if x < 110.0 {
        0.15
    } else if x < 210.0 {
        0.3
    } else {
        0.45
    }
}

#[test]
fn depth_that_contradicts_the_parallax_is_reported() {
    let scene = Scene::new([0.01, 0.02, -0.01], [0.4, 0.1, 0.0], 400.0, layers, 41).disturbed(0.2, 0.1, 42);
    let mut noise = Noise(7);
    let mut random = || -> Vec<f32> { (0..WIDTH * HEIGHT).map(|_| 0.3 + 0.2 * noise.even() as f32).collect() };
    let constant = |value: f32| [vec![value; WIDTH * HEIGHT], vec![value; WIDTH * HEIGHT]];
    for [target, reference] in [[random(), random()], constant(0.0), constant(0.5)] {
        let found = fit(&scene.matches, Some([&target, &reference]), &EstimateOptions::default()).unwrap();
        assert_eq!((found.kind, codes(&found)[0]), (ModelKind::Homography, "depth-inconsistent"));
    }
}

#[test]
fn parallax_takes_several_homographies() {
    let scene = Scene::new([0.01, 0.02, -0.01], [0.4, 0.1, 0.0], 400.0, layers, 41).disturbed(0.2, 0.1, 42);
    let count = |robust_fit| {
        let found = scene.fit(&EstimateOptions { robust_fit, ..Default::default() }).unwrap();
        (found.inliers.iter().filter(|f| **f).count(), found)
    };
    let (one, _) = count(RobustFit::Homography);
    let (several, found) = count(RobustFit::MultiHomography);
    let (depth, _) = count(RobustFit::Depth);
    assert!(2 * one < depth && 10 * several > 9 * depth, "{one} {several} {depth}");
    assert_ne!(found.kind, ModelKind::Homography);
    assert!(scene.error(&found.forward) < 1.0);
}

#[test]
fn refuses_options_out_of_range() {
    let scene = Scene::new([0.03, -0.02, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 51);
    let base = EstimateOptions::default;
    let cases = [
        ("threshold", EstimateOptions { threshold: Threshold::Pixels(0.0), ..base() }),
        ("threshold", EstimateOptions { threshold: Threshold::Normalised(f64::NAN), ..base() }),
        ("threshold", EstimateOptions { threshold: Threshold::Pixels(f64::INFINITY), ..base() }),
        ("confidence", EstimateOptions { confidence: 1.0, ..base() }),
        ("confidence", EstimateOptions { confidence: f64::NAN, ..base() }),
        ("maxTrials", EstimateOptions { max_trials: 0, ..base() }),
    ];
    for (expected, options) in cases {
        assert!(matches!(scene.fit(&options), Err(Error::InvalidArgument { name, .. }) if name == expected));
    }
    let small = InverseDepth::constant(0.5, 10, 10).unwrap();
    let frame = Frame { size: (WIDTH, HEIGHT), depth: Some(&small) };
    let error = estimate(&scene.matches, frame, frame, &base(), &mut ()).unwrap_err();
    assert_eq!(*error, Error::WrongSize { name: "targetDepth", expected: (WIDTH, HEIGHT), actual: (10, 10) });
}

#[test]
fn stops_on_request() {
    struct Impatient(u32);
    impl Observer for Impatient {
        fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
            assert_eq!(stage, Stage::Estimate);
            assert!((0.0..=1.0).contains(&fraction));
            self.0 -= 1;
            self.0 > 0
        }
    }
    let scene = Scene::new([0.03, -0.02, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 61);
    let frame = Frame { size: (WIDTH, HEIGHT), depth: None };
    for patience in [1, 2] {
        let result = estimate(&scene.matches, frame, frame, &EstimateOptions::default(), &mut Impatient(patience));
        assert_eq!(result, Err(Error::Aborted.into()));
    }
}

/// The recorded value is compared natively and in wasm: the same bytes on both.
#[test]
fn same_bits_natively_and_in_wasm() {
    let truth = Model {
        h: Matrix3::new(1.02, 0.03, -6.0, -0.02, 0.98, 4.0, 1e-5, -2e-5, 1.0),
        e: Vector3::new(40.0, -15.0, 0.05),
    };
    let mut noise = Noise(71);
    let (mut depth, mut matches) = (vec![0.0f32; WIDTH * HEIGHT], Vec::new());
    depth.iter_mut().for_each(|d| *d = (0.5 + 0.4 * noise.even()) as f32);
    for i in 0..200 {
        let (x, y) = ((20 + 14 * (i % 20)) as f64, (15 + 20 * (i / 20)) as f64);
        let d = f64::from(depth[y as usize * WIDTH + x as usize]);
        let [u, v] = truth.project(x, y, d).unwrap();
        let far = if i % 4 == 0 { 30.0 } else { 0.3 };
        matches.push(Match { target: [x, y], reference: [u + far * noise.even(), v + far * noise.even()] });
    }
    let mut bits = Vec::new();
    for robust_fit in [RobustFit::Depth, RobustFit::Homography, RobustFit::MultiHomography] {
        for options in both_free() {
            let found = fit(&matches, Some([&depth, &depth]), &EstimateOptions { robust_fit, ..options }).unwrap();
            for model in [found.forward, found.reverse] {
                bits.extend(model.h.iter().chain(model.e.iter()).map(|v| v.to_bits()));
            }
        }
    }
    assert_eq!(fingerprint(bits), 8_268_775_086_628_729_145);
}
