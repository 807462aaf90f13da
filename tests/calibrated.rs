//! Two calibrated cameras in place of the free models: what they recover, and when they are chosen.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use depthstitch::geometry::{
    Calibration, Estimate, EstimateOptions, Frame, Match, Model, ModelKind, RobustFit, Threshold, estimate,
};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::{Error, InverseDepth};
use fingerprint::fingerprint;
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod fingerprint;
mod points;

use points::*;

fn with(calibration: Calibration) -> EstimateOptions {
    EstimateOptions { calibration, ..Default::default() }
}

/// Turns large enough for the focal length to show, steps of up to a fifth of the nearest depth.
fn poses() -> impl Strategy<Value = ([f64; 3], [f64; 3], f64, u64)> {
    let angle = prop_oneof![-0.2..-0.1, 0.1..0.2];
    let step = prop_oneof![-0.4..-0.1, 0.1..0.4];
    (
        [angle.clone(), angle.clone(), angle],
        (step.clone(), step, -0.2..0.2).prop_map(|(x, y, z)| [x, y, z]),
        250.0..500.0,
        any::<u64>(),
    )
}

fn camera(focal: f64) -> Matrix3<f64> {
    Matrix3::new(focal, 0.0, 159.5, 0.0, focal, 119.5, 0.0, 0.0, 1.0)
}

/// The first two columns of the rotation, which no shift of the inverse depth changes, and the direction of translation.
fn pose(model: &Model, focal: f64) -> [Vector3<f64>; 3] {
    let k = camera(focal);
    let h = k.try_inverse().unwrap() * model.h * k;
    [h.column(0).normalize(), h.column(1).normalize(), (k.try_inverse().unwrap() * model.e).normalize()]
}

/// Largest angle between the parts of two poses, in degrees.
fn turn(a: [Vector3<f64>; 3], b: [Vector3<f64>; 3], part: std::ops::Range<usize>) -> f64 {
    part.map(|i| a[i].angle(&b[i]).to_degrees()).fold(0.0, f64::max)
}

#[test]
fn recovers_rotation_translation_and_focal_length() {
    runner(24)
        .run(&poses(), |(angles, translation, focal, seed)| {
            let scene = Scene::new(angles, translation, focal, cloud, seed);
            prop_assume!(scene.matches.len() >= 50);
            let truth = pose(&scene.truth, focal);
            for (sigma, wrong) in [(0.0, 0.0), (0.3, 0.2)] {
                let scene = scene.clone().disturbed(sigma, wrong, seed ^ 1);
                let found = scene.fit(&with(Calibration::Always)).unwrap();
                prop_assert_eq!(found.kind, ModelKind::Calibrated);
                let estimated = found.focal.unwrap();
                let off = (estimated / focal - 1.0).abs();
                prop_assert!(off < 0.002 + 0.1 * sigma, "focal length {estimated} for {focal}");
                let pose = pose(&found.forward, estimated);
                prop_assert!(turn(pose, truth, 0..2) < 0.02 + 2.0 * sigma, "{}", turn(pose, truth, 0..2));
                prop_assert!(turn(pose, truth, 2..3) < 0.5 + 10.0 * sigma, "{}", turn(pose, truth, 2..3));
                prop_assert!(scene.error(&found.forward) < 0.05 + 2.0 * sigma, "{}", scene.error(&found.forward));
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn chosen_when_the_photos_are_whole() {
    let mut sums = [0.0; 2];
    for seed in 1..11 {
        let scene =
            Scene::new([0.12, -0.1, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, seed).disturbed(0.4, 0.2, seed + 50);
        let free = scene.fit(&with(Calibration::Off)).unwrap();
        let found = scene.fit(&EstimateOptions::default()).unwrap();
        assert_eq!((free.kind, found.kind), (ModelKind::Depth, ModelKind::Calibrated));
        let comparison = found.comparison.unwrap();
        assert!(comparison.calibrated.total() < comparison.free.total());
        assert!(comparison.calibrated.penalty < comparison.free.penalty);
        for (sum, model) in sums.iter_mut().zip([free.forward, found.forward]) {
            *sum += scene.error(&model);
        }
        assert_eq!((free.focal, free.comparison), (None, None));
    }
    assert!(sums[1] < sums[0], "{sums:?}");
}

/// The principal point of a part of a photo is not at its centre.
#[test]
fn not_chosen_for_a_part_of_a_photo() {
    let scene = Scene::new([0.15, -0.2, 0.05], [0.3, -0.15, 0.1], 300.0, cloud, 3).disturbed(0.2, 0.1, 4);
    let (width, left) = (200, 120);
    let matches: Vec<Match> = scene
        .matches
        .iter()
        .map(|m| Match { target: [m.target[0] - left as f64, m.target[1]], ..*m })
        .filter(|m| m.target[0] >= 0.0)
        .collect();
    let part: Vec<f32> = scene.depth[0].chunks(WIDTH).flat_map(|row| row[left..].to_vec()).collect();
    let target = map(&part, (width, HEIGHT));
    let reference = map(&scene.depth[1], (WIDTH, HEIGHT));
    let fit = |calibration| {
        let frames = [
            Frame { size: (width, HEIGHT), depth: Some(&target) },
            Frame { size: (WIDTH, HEIGHT), depth: Some(&reference) },
        ];
        estimate(&matches, frames[0], frames[1], &with(calibration), &mut ()).unwrap()
    };
    let found = fit(Calibration::Auto);
    assert_eq!((found.kind, found.focal), (ModelKind::Depth, None));
    let comparison = found.comparison.unwrap();
    assert!(comparison.free.total() < comparison.calibrated.total());
    assert_eq!(found.forward, fit(Calibration::Off).forward);
    assert_eq!(fit(Calibration::Always).kind, ModelKind::Calibrated);
}

fn map(raw: &[f32], size: (usize, usize)) -> InverseDepth {
    InverseDepth::new("depth", raw, size, DepthKind::Inverse, None, size).unwrap()
}

/// Median distance of the true places from the fitted epipolar lines.
fn across(scene: &Scene, model: &Model) -> f64 {
    let mut all: Vec<f64> = scene.depth[0]
        .iter()
        .enumerate()
        .filter(|(_, d)| d.is_finite())
        .map(|(at, &d)| {
            let (x, y, d) = ((at % WIDTH) as f64, (at / WIDTH) as f64, f64::from(d));
            let ([u, v], [a, b]) = (scene.truth.project(x, y, d).unwrap(), model.project(x, y, d).unwrap());
            let line = [model.e[0] - a * model.e[2], model.e[1] - b * model.e[2]];
            ((u - a) * line[1] - (v - b) * line[0]).abs() / (line[0] * line[0] + line[1] * line[1]).sqrt()
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Depth from a single photo is bent; that should not bend the epipolar geometry.
#[test]
fn bent_depth_hardly_bends_the_epipolar_lines() {
    let mut sums = [0.0; 2];
    for seed in 1..6 {
        let truth = Scene::new([0.12, -0.1, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, seed).disturbed(0.2, 0.1, seed + 9);
        let mut bent = truth.clone();
        for map in &mut bent.depth {
            for (at, d) in map.iter_mut().enumerate() {
                let (x, y) = ((at % WIDTH) as f32 / 160.0 - 1.0, (at / WIDTH) as f32 / 120.0 - 1.0);
                *d += 0.02 * x * (1.0 - x * x) * (2.0 + y * y);
            }
        }
        for (sum, calibration) in sums.iter_mut().zip([Calibration::Off, Calibration::Always]) {
            *sum += across(&truth, &bent.fit(&with(calibration)).unwrap().forward) / 5.0;
        }
    }
    let [free, calibrated] = sums;
    println!("{free:.3} px free, {calibrated:.3} px calibrated");
    assert!(calibrated < 0.05 && calibrated < 0.8 * free, "{free} {calibrated}");
}

#[test]
fn affine_change_of_depth_hardly_moves_the_map() {
    let scene = Scene::new([0.12, -0.1, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 7).disturbed(0.2, 0.2, 8);
    let before = scene.fit(&with(Calibration::Always)).unwrap();
    for (scale, shift) in [(0.01, 0.0), (100.0, 0.3), (2.0, -0.4), (-1.5, 0.2)] {
        let changed = Scene {
            depth: scene.depth.clone().map(|map| map.iter().map(|d| scale * (d + shift)).collect()),
            ..scene.clone()
        };
        let after = changed.fit(&with(Calibration::Always)).unwrap();
        for m in &scene.matches {
            let [x, y] = m.target;
            let at = y as usize * WIDTH + x as usize;
            let [a, b] = before.forward.project(x, y, f64::from(scene.depth[0][at])).unwrap();
            let [u, v] = after.forward.project(x, y, f64::from(changed.depth[0][at])).unwrap();
            assert!((a - u).abs() < 0.1 && (b - v).abs() < 0.1, "{scale} {shift}: {} {}", a - u, b - v);
        }
    }
}

#[test]
fn both_directions_agree() {
    let scene = Scene::new([0.1, -0.12, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 11).disturbed(0.3, 0.2, 12);
    let round_trip = |calibration| {
        let found = scene.fit(&with(calibration)).unwrap();
        let mut sum = 0.0;
        for (at, &d) in scene.depth[0].iter().enumerate().filter(|(_, d)| d.is_finite()) {
            let (x, y, d) = ((at % WIDTH) as f64, (at / WIDTH) as f64, f64::from(d));
            let [u, v] = found.forward.project(x, y, d).unwrap();
            let seen = d / scene.truth.transform(x, y, d)[2];
            let [a, b] = found.reverse.project(u, v, seen).unwrap();
            sum += (a - x) * (a - x) + (b - y) * (b - y);
        }
        sum
    };
    assert!(round_trip(Calibration::Always) < round_trip(Calibration::Off));
}

#[test]
fn reference_of_another_size() {
    let scene = Scene::new([0.12, -0.1, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 13);
    // Pixel centres at integers: half the size.
    let half = |v: f64| (v - 0.5) / 2.0;
    let matches: Vec<Match> = scene
        .matches
        .iter()
        .map(|m| Match { reference: m.reference.map(half), ..*m })
        .filter(|m| m.reference[0] >= 0.0 && m.reference[1] >= 0.0)
        .collect();
    let small = (WIDTH / 2, HEIGHT / 2);
    let mut depth = vec![f32::NAN; small.0 * small.1];
    for m in &matches {
        let [x, y] = m.target;
        let d = f64::from(scene.depth[0][y as usize * WIDTH + x as usize]);
        let corner = m.reference[1] as usize * small.0 + m.reference[0] as usize;
        let seen = (d / scene.truth.transform(x, y, d)[2]) as f32;
        for at in [corner, corner + 1, corner + small.0, corner + small.0 + 1] {
            depth[at] = seen;
        }
    }
    let (target, reference) = (map(&scene.depth[0], (WIDTH, HEIGHT)), map(&depth, small));
    let frames =
        [Frame { size: (WIDTH, HEIGHT), depth: Some(&target) }, Frame { size: small, depth: Some(&reference) }];
    let found = estimate(&matches, frames[0], frames[1], &EstimateOptions::default(), &mut ()).unwrap();
    assert_eq!(found.kind, ModelKind::Calibrated);
    assert!((found.focal.unwrap() / 400.0 - 1.0).abs() < 0.02, "{:?}", found.focal);
    assert!(found.residual[0] < 0.1, "{:?}", found.residual);
}

#[test]
fn known_focal_length_is_kept() {
    // A step without a turn does not constrain it.
    let scene = Scene::new([0.0; 3], [0.3, -0.15, 0.0], 400.0, cloud, 17).disturbed(0.3, 0.2, 18);
    for focal in [300.0, 400.0, 600.0] {
        let options = EstimateOptions { focal: Some(focal), ..with(Calibration::Always) };
        let found = scene.fit(&options).unwrap().focal.unwrap();
        assert!((found / focal - 1.0).abs() < 0.04, "{found} for {focal}");
    }
    for bad in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        let options = EstimateOptions { focal: Some(bad), ..Default::default() };
        assert!(matches!(scene.fit(&options), Err(Error::InvalidArgument { name: "focalLength", .. })));
    }
}

#[test]
fn no_parallax_gives_the_homography_all_the_same() {
    let turn = ([0.05, -0.06, 0.04], [0.0; 3]);
    let step = ([0.02, 0.03, -0.02], [0.3, 0.2, 0.1]);
    let cases: [(_, Surface); 3] = [(turn, cloud), (step, plane), (step, constant)];
    for ((angles, translation), surface) in cases {
        let scene = Scene::new(angles, translation, 400.0, surface, 1).disturbed(0.3, 0.2, 2);
        let found = scene.fit(&with(Calibration::Always)).unwrap();
        assert_eq!(found.kind, ModelKind::Homography);
        assert_eq!((found.focal, found.comparison), (None, None));
    }
}

#[test]
fn few_matches_are_kept_in_check() {
    let exact = Scene::new([0.1, -0.12, 0.05], [0.3, -0.15, 0.1], 400.0, cloud, 19);
    let all = exact.clone().disturbed(0.3, 0.0, 20);
    let mut compared = 0;
    for n in [6, 7, 8, 12, 20] {
        let matches: Vec<Match> = (0..n).map(|i| all.matches[(i * 37 + 3) % all.matches.len()]).collect();
        let scene = Scene { matches, ..all.clone() };
        let Ok(found) = scene.fit(&with(Calibration::Always)) else { continue };
        if found.kind == ModelKind::Homography {
            continue;
        }
        let free = scene.fit(&with(Calibration::Off)).unwrap();
        let (calibrated, free) = (exact.error(&found.forward), exact.error(&free.forward));
        println!("{n} matches: {calibrated:.1} px calibrated, {free:.1} px free");
        assert!(found.forward.is_finite() && found.reverse.is_finite());
        assert!(calibrated < free.max(5.0), "{n}: {calibrated} {free}");
        compared += 1;
    }
    assert!(compared > 2, "{compared}");
}

/// The recorded value is compared natively and in wasm: the same bytes on both.
#[test]
fn same_bits_natively_and_in_wasm() {
    let mut bits = Vec::new();
    for (robust_fit, threshold) in [
        (RobustFit::Depth, Threshold::Pixels(3.0)),
        (RobustFit::Depth, Threshold::PAPER),
        (RobustFit::MultiHomography, Threshold::Pixels(3.0)),
    ] {
        let scene = Scene::new([0.0; 3], [0.3, -0.15, 0.1], 400.0, cloud, 23).disturbed(0.4, 0.3, 24);
        let options = EstimateOptions { robust_fit, threshold, ..with(Calibration::Always) };
        let Estimate { forward, reverse, focal, .. } = scene.fit(&options).unwrap();
        let values =
            [forward, reverse].into_iter().flat_map(|m| m.h.iter().chain(m.e.iter()).copied().collect::<Vec<_>>());
        bits.extend(values.chain(focal).map(f64::to_bits));
    }
    assert_eq!(fingerprint(bits), 17_254_577_401_795_627_149);
}
