//! Inverse depth from matches of two photos alone, on surfaces of which everything is known.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod points;

use depthstitch::depth::{TwoView, two_view};
use depthstitch::geometry::{EstimateOptions, Match, Model, ModelKind, Threshold};
use depthstitch::observer::Observer;
use depthstitch::{Error, Image, Stage};
use nalgebra::{Matrix4, Vector3, Vector4};
use proptest::prelude::*;
use scene::{distance, quantile};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Hills and a valley: no plane of depth anywhere.
fn hills(x: f64, y: f64, _: &mut points::Noise) -> f64 {
    let (x, y) = (x / 160.0 - 1.0, y / 120.0 - 1.0);
    0.3 + 0.12 * x * x - 0.1 * y * y + 0.1 * x * y * y
}

/// Turns of some degrees, steps of up to a fifth of the nearest depth.
fn poses() -> impl Strategy<Value = ([f64; 3], [f64; 3], f64, u64)> {
    let angle = -0.08..0.08;
    let step = prop_oneof![-0.5..-0.2, 0.2..0.5];
    (
        [angle.clone(), angle.clone(), angle],
        (step.clone(), step, -0.2..0.2).prop_map(|(x, y, z)| [x, y, z]),
        250.0..600.0,
        any::<u64>(),
    )
}

fn gray() -> Image {
    Image::new(vec![128; 4 * points::WIDTH * points::HEIGHT], points::WIDTH, points::HEIGHT).unwrap()
}

fn solve(matches: &[Match], seed: u32) -> TwoView {
    solve_with(matches, &gray(), &EstimateOptions { seed, ..Default::default() })
}

fn solve_with(matches: &[Match], photo: &Image, options: &EstimateOptions) -> TwoView {
    two_view(matches, photo.view(), photo.view(), options, &mut ()).unwrap()
}

/// Distance of a point from the epipolar line of another.
fn line_distance(model: &Model, [x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    let line = Vector3::from(model.transform(x, y, 0.0)).cross(&model.e);
    (line[0] * u + line[1] * v + line[2]).abs() / line[0].hypot(line[1])
}

/// Largest distance of true images, at any depth, from the epipolar lines of `found`.
fn line_error(found: &Model, truth: &Model) -> f64 {
    let mut worst = 0.0f64;
    for (x, y) in [(20.0, 20.0), (300.0, 20.0), (160.0, 120.0), (20.0, 220.0), (300.0, 220.0)] {
        for d in [0.1, 0.3, 0.5] {
            worst = worst.max(line_distance(found, [x, y], truth.project(x, y, d).unwrap()));
        }
    }
    worst
}

#[test]
fn exact_matches_give_the_epipolar_geometry_and_depth_up_to_an_increasing_affine_change() {
    points::runner(24)
        .run(&poses(), |(angles, translation, focal, seed)| {
            let scene = points::Scene::new(angles, translation, focal, hills, seed);
            prop_assume!(scene.matches.len() >= 60);
            let found = solve(&scene.matches, 1);
            let geometry = &found.geometry;
            prop_assert_eq!(geometry.kind, ModelKind::TwoView);
            prop_assert!(line_error(&geometry.forward, &scene.truth) < 1e-3);
            prop_assert!(geometry.inliers.iter().filter(|f| **f).count() * 10 > scene.matches.len() * 8);
            prop_assert!(geometry.residual[0] < 1e-4 && geometry.residual[1] < 1e-4, "{:?}", geometry.residual);
            let (ends, affine) = affine_change(&geometry.forward, &scene.matches, &scene.depth[0]);
            prop_assert!(affine[0] > 0.0, "larger is nearer: {}", affine[0]);
            for (row, d) in &ends {
                prop_assert!((row.dot(&affine) - d).abs() < 1e-4);
            }
            Ok(())
        })
        .unwrap();
}

/// (H, e, g) maps as (H∞, e', d) does, so d = αg + βx + γy + δ: the row g, x, y, 1 and d of each match, and the α, β, γ, δ that fit best.
fn affine_change(model: &Model, matches: &[Match], depth: &[f32]) -> (Vec<(Vector4<f64>, f64)>, Vector4<f64>) {
    let end = |m: &Match| {
        let [x, y] = m.target;
        let truth = depth[y as usize * points::WIDTH + x as usize];
        (Vector4::new(exact_depth(model, m), x, y, 1.0), f64::from(truth))
    };
    let ends: Vec<(Vector4<f64>, f64)> = matches.iter().map(end).collect();
    let (mut normal, mut rhs) = (Matrix4::zeros(), Vector4::zeros());
    for (row, d) in &ends {
        normal += row * row.transpose();
        rhs += row * *d;
    }
    (ends, normal.try_inverse().unwrap() * rhs)
}

/// An essential matrix of a focal length that is not the right one has unequal singular values, the more so the more the cameras turn.
#[test]
fn larger_is_nearer_though_neither_lens_nor_turn_is_known() {
    let turn = || prop_oneof![-0.35..-0.2, 0.2..0.35];
    let poses = (turn(), prop_oneof![-0.5..-0.3, 0.3..0.5], -0.3..0.1, 260.0..340.0, any::<u64>());
    points::runner(48)
        .run(&poses, |(yaw, aside, ahead, focal, seed)| {
            let scene = points::Scene::new([0.02, yaw, -0.03], [aside, 0.03, ahead], focal, hills, seed);
            prop_assume!(scene.matches.len() >= 100);
            let scene = scene.disturbed(0.3, 0.1, seed ^ 1);
            let geometry = solve(&scene.matches, 1).geometry;
            prop_assume!(geometry.kind == ModelKind::TwoView);
            let inliers: Vec<Match> =
                scene.matches.iter().zip(&geometry.inliers).filter(|(_, inlier)| **inlier).map(|(m, _)| *m).collect();
            let (_, affine) = affine_change(&geometry.forward, &inliers, &scene.depth[0]);
            prop_assert!(affine[0] > 0.0, "{}", affine[0]);
            Ok(())
        })
        .unwrap();
}

/// The g of a match, from its image: u × (Hx + e·g) = 0.
fn exact_depth(model: &Model, m: &Match) -> f64 {
    let u = Vector3::new(m.reference[0], m.reference[1], 1.0);
    let (h, e) = (u.cross(&Vector3::from(model.transform(m.target[0], m.target[1], 0.0))), u.cross(&model.e));
    -h.dot(&e) / e.dot(&e)
}

#[test]
fn noise_and_outliers_are_tolerated() {
    points::runner(24)
        .run(&(poses(), 0.0..0.4), |((angles, translation, focal, seed), wrong)| {
            let exact = points::Scene::new(angles, translation, focal, hills, seed);
            prop_assume!(exact.matches.len() >= 120);
            let scene = exact.clone().disturbed(0.3, wrong, seed ^ 1);
            let found = solve(&scene.matches, 1);
            prop_assert_eq!(found.geometry.kind, ModelKind::TwoView);
            let far = exact.matches.iter().map(|m| line_distance(&found.geometry.forward, m.target, m.reference));
            let far: Vec<f64> = far.collect();
            prop_assert!(
                quantile(far.clone(), 0.5) < 0.4 && quantile(far.clone(), 1.0) < 2.0,
                "{}",
                quantile(far, 1.0)
            );
            for ((m, m0), flag) in scene.matches.iter().zip(&exact.matches).zip(&found.geometry.inliers) {
                let moved = distance(m.reference, m0.reference);
                // Even along the epipolar line, where only the neighbours constrain it.
                prop_assert!(moved < 25.0 || !*flag, "{moved}");
                if *flag && moved < 2.0 {
                    let [x, y] = m.target;
                    let place = found.geometry.forward.project(x, y, found.target.sample(x, y)).unwrap();
                    prop_assert!(distance(place, m.reference) < 6.0, "{}", distance(place, m.reference));
                }
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn another_seed_finds_the_same_geometry() {
    let counted = std::cell::Cell::new((0, 0));
    points::runner(16)
        .run(&poses(), |(angles, translation, focal, seed)| {
            let scene = points::Scene::new(angles, translation, focal, hills, seed).disturbed(0.3, 0.2, seed ^ 1);
            prop_assume!(scene.matches.len() >= 120);
            let [one, other] = [1, 2].map(|seed| solve(&scene.matches, seed).geometry.forward);
            let (same, all) = counted.get();
            counted.set((same + usize::from(line_error(&other, &one) < 1e-3), all + 1));
            Ok(())
        })
        .unwrap();
    let (same, all) = counted.get();
    // A cost with outliers may have several minima.
    assert!(8 * same >= 7 * all, "{same} of {all}");
}

/// Steps so short that noise leaves several directions of about the same cost.
#[test]
fn another_seed_finds_the_same_geometry_of_cameras_that_hardly_moved() {
    let poses =
        ([-0.08..0.08, -0.08..0.08, -0.08..0.08], [-0.1..0.1, -0.1..0.1, -0.1..0.1], 250.0..600.0, any::<u64>());
    let counted = std::cell::Cell::new((0, 0));
    points::runner(32)
        .run(&poses, |(angles, translation, focal, seed)| {
            let scene = points::Scene::new(angles, translation, focal, hills, seed).disturbed(0.3, 0.2, seed ^ 1);
            let found = [1, 2, 3].map(|seed| solve(&scene.matches, seed).geometry);
            prop_assume!(found.iter().all(|found| found.kind == ModelKind::TwoView));
            let [one, others @ ..] = found.map(|found| found.forward);
            let (same, all) = counted.get();
            counted.set((same + others.iter().filter(|other| line_error(other, &one) < 0.1).count(), all + 2));
            Ok(())
        })
        .unwrap();
    let (same, all) = counted.get();
    assert!(4 * same >= 3 * all, "{same} of {all}");
}

/// Exact matches of what lies `step` pixels apart in x from..to and y from..to.
fn grid(truth: &Model, surface: points::Surface, [x, y]: [std::ops::Range<usize>; 2], step: usize) -> Vec<Match> {
    let places = y.step_by(step).flat_map(|y| x.clone().step_by(step).map(move |x| [x as f64, y as f64]));
    let seen = |[x, y]: [f64; 2]| truth.project(x, y, surface(x, y, &mut points::Noise(0)));
    let within =
        |[u, v]: &[f64; 2]| (0.0..points::WIDTH as f64).contains(u) && (0.0..points::HEIGHT as f64).contains(v);
    places.filter_map(|target| Some(Match { target, reference: seen(target).filter(within)? })).collect()
}

#[test]
fn matches_that_a_lens_bends_off_their_lines_take_part() {
    let bent = |[x, y]: [f64; 2]| {
        let (dx, dy) = (x - 159.5, y - 119.5);
        let r = (dx * dx + dy * dy) / 4e4;
        let share = 1.0 - 0.2 * r + 0.1 * r * r;
        [159.5 + dx * share, 119.5 + dy * share]
    };
    for turn in [0.04, 0.1] {
        let truth = points::Scene::new([0.02, -turn, 0.01], [0.3, 0.1, -0.1], 320.0, hills, 1).truth;
        // Many in the middle, a few in a corner, where the lens bends most.
        let mut matches = grid(&truth, hills, [0..320, 0..150], 7);
        let many = matches.len();
        matches.extend(grid(&truth, hills, [0..90, 190..240], 12));
        let corner = matches.len() - many;
        for m in &mut matches {
            *m = Match { target: bent(m.target), reference: bent(m.reference) };
        }
        // Next to a picture that small, as much as 1 is next to an ordinary one.
        let options = EstimateOptions { threshold: Threshold::Pixels(0.3), ..Default::default() };
        let found = solve_with(&matches, &gray(), &options).geometry;
        assert_eq!(found.kind, ModelKind::TwoView);
        let inliers = found.inliers[many..].iter().filter(|inlier| **inlier).count();
        assert!(inliers * 10 > corner * 8, "{inliers} of {corner}");
    }
}

#[test]
fn matches_of_a_dense_matcher_are_as_good_as_a_few() {
    let truth = points::Scene::new([0.01, 0.02, 0.0], [0.3, 0.05, -0.1], 320.0, hills, 1).truth;
    let mut matches = grid(&truth, hills, [0..320, 0..240], 2);
    let many = matches.len();
    assert!(many > 12_000, "{many}");
    // What moved along the epipolar line contradicts nothing but its neighbours.
    for (i, m) in matches.iter_mut().step_by(7).enumerate() {
        let [x, y] = m.target;
        let factor = 1.5 + 0.25 * (i % 8) as f64;
        m.reference = truth.project(x, y, factor * hills(x, y, &mut points::Noise(0))).unwrap();
    }
    let found = solve(&matches, 1);
    let wrong = found.geometry.inliers.iter().step_by(7).filter(|inlier| **inlier).count();
    assert!(wrong * 50 < many / 7, "{wrong} wrong of {}", many / 7);
    let miss = |m: &Match| {
        let [x, y] = m.target;
        let place = found.geometry.forward.project(x, y, found.target.sample(x, y)).unwrap();
        distance(place, m.reference)
    };
    let right = matches.iter().enumerate().filter(|(i, _)| i % 7 != 0);
    let misses = right.map(|(_, m)| miss(m)).collect();
    assert!(quantile(misses, 0.9) < 0.5);
}

/// A wall, and below it a floor that comes nearer.
fn room(_: f64, y: f64, _: &mut points::Noise) -> f64 {
    0.2 + 0.002 * (y - FOOT).max(0.0)
}

/// Where the wall ends.
const FOOT: f64 = 120.0;

#[test]
fn depth_is_extrapolated_far_from_all_matches() {
    let mut photo = gray();
    for (y, row) in photo.data_mut().chunks_exact_mut(4 * points::WIDTH).enumerate() {
        row.fill(if y as f64 >= FOOT { 200 } else { 60 });
    }
    let truth = points::Scene::new([0.0, 0.02, 0.0], [0.3, 0.05, 0.0], 320.0, room, 1).truth;
    let matches = grid(&truth, room, [0..320, 0..165], 6);
    let found = solve_with(&matches, &photo, &EstimateOptions::default());
    for (x, y) in [(60.0, 210.0), (160.0, 210.0), (260.0, 210.0), (160.0, 230.0)] {
        let place = found.geometry.forward.project(x, y, found.target.sample(x, y)).unwrap();
        let truth = truth.project(x, y, room(x, y, &mut points::Noise(0))).unwrap();
        assert!(distance(place, truth) < 2.5, "{}", distance(place, truth));
    }
}

#[test]
fn epipole_in_the_picture_is_no_obstacle() {
    // Straight ahead: things move away from the middle, and those in the middle not at all.
    let scene = points::Scene::new([0.01, -0.02, 0.03], [0.02, -0.01, -0.6], 300.0, hills, 4).disturbed(0.2, 0.1, 5);
    let found = solve(&scene.matches, 1);
    assert_eq!(found.geometry.kind, ModelKind::TwoView);
    let e = &found.geometry.forward.e;
    assert!(distance([e[0] / e[2], e[1] / e[2]], [159.5, 119.5]) < 30.0);
    let errors = scene.matches.iter().zip(&found.geometry.inliers).filter(|(_, f)| **f).map(|(m, _)| {
        let [x, y] = m.target;
        distance(found.geometry.forward.project(x, y, found.target.sample(x, y)).unwrap(), m.reference)
    });
    assert!(quantile(errors.collect(), 0.9) < 1.5);
}

#[test]
fn too_few_matches_are_an_error_or_a_homography() {
    let scene = points::Scene::new([0.0, 0.02, 0.0], [0.3, -0.2, 0.1], 400.0, hills, 3);
    let photo = gray();
    let run = |matches: &[Match]| {
        two_view(matches, photo.view(), photo.view(), &Default::default(), &mut ()).map_err(|error| *error)
    };
    for n in 0..4 {
        let found = run(&scene.matches[..n]);
        assert!(matches!(found, Err(Error::TooFewMatches { needed: 4, .. })), "{n}: {found:?}");
    }
    // Close together, seven are explained by a homography.
    if let Ok(found) = run(&scene.matches[..7]) {
        assert_eq!(found.geometry.kind, ModelKind::Homography);
    }
    let nowhere: Vec<Match> = (0..20).map(|_| Match { target: [f64::NAN; 2], reference: [1e9; 2] }).collect();
    assert!(matches!(run(&nowhere), Err(Error::TooFewMatches { usable: 0, .. })));
    let line: Vec<Match> =
        (0..40).map(|i| Match { target: [5.0 * f64::from(i), 20.0], reference: [4.0 * f64::from(i), 30.0] }).collect();
    assert!(matches!(run(&line), Err(Error::DegenerateGeometry { .. })));
    let random: Vec<Match> = {
        let mut noise = points::Noise(9);
        let mut place = || [160.0 + 150.0 * noise.even(), 120.0 + 110.0 * noise.even()];
        (0..100).map(|_| Match { target: place(), reference: place() }).collect()
    };
    assert!(matches!(run(&random), Err(Error::NoConsensus { .. })));
}

struct Stop;

impl Observer for Stop {
    fn progress(&mut self, stage: Stage, _: f32) -> bool {
        stage != Stage::Depth
    }
}

#[test]
fn stops_when_asked_to() {
    let scene = points::Scene::new([0.0, 0.02, 0.0], [0.3, -0.2, 0.1], 400.0, hills, 3);
    let photo = gray();
    let found = two_view(&scene.matches, photo.view(), photo.view(), &Default::default(), &mut Stop);
    assert_eq!(found, Err(Error::Aborted.into()));
}
