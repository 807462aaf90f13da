//! The whole way on real and rendered pairs from files: the paper's numbers, and what must be refused. Reads
//! `DEPTHSTITCH_DATA`.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use depthstitch::geometry::{Match, ModelKind, RobustFit};
use depthstitch::metrics::{Quality, appearance};
use depthstitch::observer::Observer;
use depthstitch::pipeline::{Options, Stitched, stitch};
use depthstitch::warp::{WarpMode, WarpOptions};
use depthstitch::{Result, Stage, View};
use scene::Photos;

/// The pair the paper's numbers are for.
const PAIR: &str = "nis-PTS_17";

fn load(name: &str) -> Option<Photos> {
    Some(cases::load(&cases::real_case(name)?).photos)
}

fn paper() -> Options {
    Options { fill: None, ..Options::paper() }
}

fn run(case: &Photos, options: &Options) -> Result<Stitched> {
    stitch(Some(&case.matches), case.target(), case.reference(), options, &mut ())
}

fn quality(case: &Photos, options: &Options) -> Quality {
    run(case, options).unwrap().quality
}

fn codes(found: &Stitched) -> Vec<&'static str> {
    found.warnings.iter().map(|warning| warning.code()).collect()
}

/// The authors' program reaches 17.35 dB, 0.608, 0.524.
#[test]
fn paper_threshold_reaches_the_floors_with_every_seed() {
    let Some(case) = load(PAIR) else { return };
    let mut all = Vec::new();
    for seed in 1..=10 {
        let mut options = paper();
        options.estimate.seed = seed;
        let Quality { psnr_bbox, ssim_bbox, coverage, .. } = quality(&case, &options);
        println!("seed {seed}: {psnr_bbox:.2} dB, SSIM {ssim_bbox:.3}, coverage {coverage:.3}");
        assert!(psnr_bbox >= 17.20 && ssim_bbox >= 0.598 && coverage >= 0.514, "seed {seed}");
        all.push(psnr_bbox);
    }
    let (least, most) = all.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    assert!(most - least < 0.2, "seeds differ by {:.2} dB", most - least);
}

/// Paper, table 2, rows 3, 4, 5 and 8.
#[test]
fn every_module_of_the_warp_gains_something() {
    let Some(case) = load(PAIR) else { return };
    let geometry = run(&case, &paper()).unwrap().geometry;
    let psnr = [WarpMode::Backward, WarpMode::Forward, WarpMode::BackwardVoid, WarpMode::Optimal].map(|mode| {
        let options = Options { warp: WarpOptions { mode, ..Default::default() }, ..paper() };
        let found = run(&case, &options).unwrap();
        assert_eq!(found.geometry, geometry, "the warp has no say in the geometry");
        println!("{mode:?}: {:.2} dB, coverage {:.3}", found.quality.psnr_bbox, found.quality.coverage);
        found.quality.psnr_bbox
    });
    let [backward, forward, void, optimal] = psnr;
    assert!(backward < forward && forward < void && void <= optimal, "{psnr:.2?}");
}

/// Paper, table 2, rows 1, 2 and 8.
#[test]
fn inliers_of_homographies_give_a_worse_map() {
    let Some(case) = load(PAIR) else { return };
    let psnr = [RobustFit::Homography, RobustFit::MultiHomography, RobustFit::Depth].map(|robust_fit| {
        let mut options = paper();
        options.estimate.robust_fit = robust_fit;
        let found = quality(&case, &options);
        println!(
            "{robust_fit:?}: {:.2} dB, SSIM {:.3}, coverage {:.3}",
            found.psnr_bbox, found.ssim_bbox, found.coverage
        );
        found.psnr_bbox
    });
    let [one, several, depth] = psnr;
    assert!(one < depth && several < depth, "{psnr:.2?}");
}

#[test]
fn hardly_any_texture_is_reported() {
    let Some(case) = load("tartanair-0180_0188") else { return };
    for options in [Options::default(), paper()] {
        let found = codes(&run(&case, &options).unwrap());
        assert!(found.contains(&"few-inliers") || found.contains(&"low-inlier-ratio"), "{found:?}");
    }
}

/// A photo's own matches joined at random, as a matcher leaves them between photos of different places.
fn shuffled(matches: &[Match], other: &[Match], seed: usize) -> Vec<Match> {
    const STRIDE: usize = 7919;
    (0..matches.len())
        .map(|i| Match { target: matches[i].target, reference: other[(i * STRIDE + seed) % other.len()].reference })
        .collect()
}

#[test]
fn photos_of_different_places_have_no_consensus() {
    let names = [PAIR, "middlebury2005-Art", "icl-0160_0175", "tartanair-0050_0060", "mono-icl-0025_0090"];
    for (i, name) in names.into_iter().enumerate() {
        let (Some(one), Some(other)) = (load(name), load(names[(i + 1) % names.len()])) else { continue };
        for seed in 1..=3 {
            let matches = shuffled(&one.matches, &other.matches, seed);
            for options in [Options::default(), paper()] {
                let result = stitch(Some(&matches), one.target(), other.reference(), &options, &mut ());
                let code = result.map_err(|error| error.code()).map(|found| codes(&found));
                assert_eq!(code, Err("no-consensus"), "{name}, seed {seed}, {:?}", options.estimate.threshold);
            }
        }
    }
}

/// With the paper's threshold of some 15 px a wrong order of one pair's own matches must not pass either.
#[test]
fn matches_in_the_wrong_order_have_no_consensus() {
    let Some(case) = load(PAIR) else { return };
    for options in [Options::default(), paper()] {
        let matches = shuffled(&case.matches, &case.matches, 500);
        let result = stitch(Some(&matches), case.target(), case.reference(), &options, &mut ());
        assert_eq!(result.map(|_| ()).map_err(|error| error.code()), Err("no-consensus"));
    }
}

#[test]
fn photos_without_depth_are_aligned_by_a_homography_or_from_two_views() {
    for name in ["photo-sgla-16", "photo-rew-DHW-temple"] {
        let Some(case) = load(name) else { continue };
        let flat = run(&case, &paper()).unwrap();
        assert_eq!(flat.geometry.kind, ModelKind::Homography);
        assert!(codes(&flat).contains(&"no-depth"), "{name}");
        let deep = run(&case, &Options { fill: None, ..Options::default() }).unwrap();
        assert_eq!(deep.geometry.kind, ModelKind::TwoView);
        let (found, before) = (deep.quality, flat.quality);
        println!("{name}: SSIM {:.3} to {:.3}", before.ssim_bbox, found.ssim_bbox);
        assert!(found.ssim_bbox > before.ssim_bbox + 0.1 && found.coverage > before.coverage - 0.06, "{name}");
    }
}

/// The pair of the paper, refined: better than with the depth as it is.
#[test]
fn refinement_gains() {
    let Some(case) = load(PAIR) else { return };
    let found = quality(&case, &Options { fill: None, ..Options::default() });
    let Quality { psnr_bbox, ssim_bbox, coverage, .. } = found;
    println!("{psnr_bbox:.2} dB, SSIM {ssim_bbox:.3}, coverage {coverage:.3}");
    assert!(psnr_bbox > 19.5 && ssim_bbox > 0.79 && coverage > 0.52, "{found:?}");
}

/// Notices progress that goes back to a stage before the refinement.
#[derive(Default)]
struct Stages {
    refined: bool,
    went_back: bool,
}

impl Observer for Stages {
    fn progress(&mut self, stage: Stage, _: f32) -> bool {
        self.refined |= stage == Stage::Refine;
        self.went_back |= self.refined && matches!(stage, Stage::Estimate | Stage::Depth);
        true
    }
}

/// What a person took for right: a homography, a plane outside the reference, and the surface itself. Whichever it is, no
/// straight line may be broken outside.
#[test]
fn what_only_the_target_shows_looks_natural() {
    for (name, expected) in [
        ("photo-lpc-cup", Some("parallax-ignored")),
        ("photo-sgla-04", Some("outside-extrapolated")),
        ("photo-rew-DHW-temple", None),
    ] {
        let Some(case) = load(name) else { continue };
        let mut stages = Stages::default();
        let options = Options { output_depth: true, ..Options::default() };
        let found = stitch(Some(&case.matches), case.target(), case.reference(), &options, &mut stages).unwrap();
        assert!(!stages.went_back, "{name}: estimation or depth after refinement");
        let said = codes(&found).into_iter().find(|code| ["parallax-ignored", "outside-extrapolated"].contains(code));
        assert_eq!(said, expected, "{name}");
        assert_eq!(found.geometry.kind == ModelKind::Homography, said == Some("parallax-ignored"), "{name}");
        let target = View { depth: found.depth[0].as_ref(), ..case.target() };
        let Stitched { geometry, warped, mosaic, .. } = &found;
        let seen = appearance(target, case.reference().image, &geometry.forward, warped, mosaic).unwrap();
        assert_eq!(seen.broken_lines.outside.broken, 0, "{name}");
        assert!(seen.bending.unwrap_or(0.0) < 2.0, "{name}: {:?}", seen.bending);
    }
}

/// A network's maps bow the fence and the façade that only the target shows: they are corrected there so that straight lines are straight.
#[test]
fn inexact_maps_break_no_lines_outside() {
    let Some(case) = load(PAIR) else { return };
    let found = run(&case, &Options { output_depth: true, ..Options::default() }).unwrap();
    assert_eq!(found.geometry.comparison.map(|comparison| comparison.exact), Some(false));
    let target = View { depth: found.depth[0].as_ref(), ..case.target() };
    let Stitched { geometry, warped, mosaic, quality, .. } = &found;
    let seen = appearance(target, case.reference().image, &geometry.forward, warped, mosaic).unwrap();
    assert_eq!(seen.broken_lines.outside.broken, 0, "of {}", seen.broken_lines.outside.lines);
    assert!(seen.broken_lines.outside.lines >= 5);
    assert!(quality.psnr_bbox > 21.0 && quality.coverage > 0.5, "{quality:?}");
}
