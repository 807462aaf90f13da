//! The robust fit on real and rendered pairs: the fitted map against the true one. Reads `DEPTHSTITCH_DATA`.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use cases::Case;
use depthstitch::View;
use depthstitch::geometry::{
    Calibration, Estimate, EstimateOptions, Frame, Model, ModelKind, RobustFit, Threshold, estimate,
};

/// Reference figures: medians of the map error with the paper's threshold, in pixels: within the reference's frame, and outside.
const FLOORS: [(&str, [f64; 2]); 6] = [
    ("middlebury2005-Art", [0.21, 0.23]),
    ("middlebury2003-Cones", [0.16, 0.21]),
    ("icl-0025_0090", [0.35, 1.43]),
    ("icl-0160_0175", [0.40, 0.31]),
    ("icl-0000_0040", [0.58, 1.47]),
    ("tartanair-0050_0060", [1.29, 2.08]),
];
const TOLERANCE: f64 = 0.2;

fn load(name: &str) -> Option<Case> {
    Some(cases::load(&cases::real_case(name)?))
}

fn frame<'a>(view: &View<'a>) -> Frame<'a> {
    Frame { size: view.image.size(), depth: view.depth }
}

fn fit(Case { photos, .. }: &Case, options: &EstimateOptions) -> Estimate {
    estimate(&photos.matches, frame(&photos.target()), frame(&photos.reference()), options, &mut ()).unwrap()
}

/// Median error of the map on every fourth pixel with depth, within the reference's frame and outside.
fn errors(case: &Case, model: &Model) -> [f64; 2] {
    let (truth, depth) = (case.truth.unwrap(), case.photos.target_depth.as_ref().unwrap());
    let size = [case.photos.reference.width() as f64, case.photos.reference.height() as f64];
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for y in (0..depth.height()).step_by(4) {
        for x in (0..depth.width()).step_by(4) {
            let d = f64::from(depth.data()[y * depth.width() + x]);
            let Some([u, v]) = truth.project(x as f64, y as f64, d).filter(|_| d > 0.0) else { continue };
            let [a, b, w] = model.transform(x as f64, y as f64, d);
            let error = ((a / w - u) * (a / w - u) + (b / w - v) * (b / w - v)).sqrt();
            if u >= 0.0 && v >= 0.0 && u < size[0] && v < size[1] {
                inside.push(error);
            } else if u.abs() < 3000.0 && v.abs() < 3000.0 {
                outside.push(error);
            }
        }
    }
    [median(inside), median(outside)]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn inliers(found: &Estimate) -> usize {
    found.inliers.iter().filter(|f| **f).count()
}

fn free() -> EstimateOptions {
    EstimateOptions { calibration: Calibration::Off, ..Default::default() }
}

fn paper() -> EstimateOptions {
    EstimateOptions { threshold: Threshold::PAPER, ..free() }
}

fn seeds(options: &EstimateOptions) -> impl Iterator<Item = EstimateOptions> + '_ {
    (1..=10).map(|seed| EstimateOptions { seed, ..options.clone() })
}

#[test]
fn free_model_reaches_the_floor_with_every_seed() {
    for (name, floor) in FLOORS {
        let Some(case) = load(name) else { continue };
        for options in seeds(&free()) {
            let found = fit(&case, &options);
            let errors = errors(&case, &found.forward);
            println!("{name} seed {}: {} inliers, {errors:.2?} px", options.seed, inliers(&found));
            assert_eq!(found.kind, ModelKind::Depth);
            assert_eq!(found.warnings, []);
            assert!(errors[0] < floor[0] + TOLERANCE && errors[1] < floor[1] + TOLERANCE, "{name}: {errors:?}");
        }
    }
}

/// Medians of the calibrated models' map error that no seed may exceed, in pixels: within the reference's frame and outside,
/// and the true focal length.
const CALIBRATED: [(&str, [f64; 2], Option<f64>); 8] = [
    ("middlebury2005-Art", [0.2, 0.35], None),
    ("middlebury2003-Cones", [0.2, 0.25], None),
    ("icl-0025_0090", [0.15, 0.2], Some(525.0)),
    ("icl-0160_0175", [0.4, 0.4], Some(525.0)),
    ("icl-0000_0040", [0.6, 1.0], Some(525.0)),
    ("icl-0002_0004", [0.4, 30.0], Some(481.2)),
    ("tartanair-0050_0060", [0.25, 0.3], Some(320.0)),
    ("tartanair-0180_0188", [0.5, 0.7], Some(320.0)),
];

#[test]
fn calibrated_models_hold_outside_the_frame_with_every_seed() {
    for (name, floor, focal) in CALIBRATED {
        let Some(case) = load(name) else { continue };
        for options in seeds(&EstimateOptions::default()) {
            let found = fit(&case, &options);
            let errors = errors(&case, &found.forward);
            println!("{name} seed {}: {errors:.2?} px, focal length {:.0?}", options.seed, found.focal);
            assert_eq!(found.kind, ModelKind::Calibrated);
            assert!(errors[0] < floor[0] && errors[1] < floor[1], "{name}: {errors:?}");
            assert!(focal.is_none_or(|f| (found.focal.unwrap() / f - 1.0).abs() < 0.05), "{name}: {:?}", found.focal);
        }
    }
}

#[test]
fn calibrated_models_are_no_worse_within_the_frame() {
    for name in FLOORS.map(|(name, _)| name).into_iter().chain(["icl-0002_0004", "kinect-0002_0003"]) {
        let Some(case) = load(name) else { continue };
        for calibration in [Calibration::Auto, Calibration::Always] {
            let of = |calibration| {
                errors(&case, &fit(&case, &EstimateOptions { calibration, ..Default::default() }).forward)[0]
            };
            let (free, found) = (of(Calibration::Off), of(calibration));
            assert!(found < free + 0.3, "{name} {calibration:?}: {found:.2} px, {free:.2} px without");
        }
    }
}

/// Whatever the seed: refined only once, on all matches within some 12 px, icl-0000_0040 ended 1.5 to 7 px off outside the
/// frame.
#[test]
fn paper_threshold_reaches_the_floor() {
    for (name, floor) in FLOORS {
        let Some(case) = load(name) else { continue };
        let all: Vec<[f64; 2]> = seeds(&paper()).map(|options| errors(&case, &fit(&case, &options).forward)).collect();
        let worst = [0, 1].map(|i| all.iter().map(|e| e[i]).fold(0.0, f64::max));
        println!("{name}: {worst:.2?} px, the worst of ten seeds");
        assert!(worst[0] < floor[0] + TOLERANCE && worst[1] < floor[1] + TOLERANCE, "{name}: {worst:?}");
    }
}

#[test]
fn paper_threshold_finds_as_many_inliers() {
    for (name, expected) in [
        ("nis-PTS_17", 956),
        ("middlebury2003-Cones", 898),
        ("middlebury2005-Art", 609),
        ("icl-0025_0090", 357),
        ("icl-0000_0040", 147),
        ("tartanair-0050_0060", 144),
    ] {
        let Some(case) = load(name) else { continue };
        let found = inliers(&fit(&case, &paper()));
        println!("{name}: {found} inliers");
        assert!(found + 2 >= expected, "{name}: {found}");
    }
}

#[test]
fn seed_hardly_moves_the_real_pair() {
    let Some(case) = load("nis-PTS_17") else { return };
    let first = fit(&case, &EstimateOptions::default());
    for options in seeds(&EstimateOptions::default()) {
        let found = fit(&case, &options);
        let moved = case.photos.matches.iter().map(|m| {
            let [x, y] = m.target;
            let d = case.photos.target_depth.as_ref().unwrap().sample(x, y);
            let ([a, b], [u, v]) = (first.forward.project(x, y, d).unwrap(), found.forward.project(x, y, d).unwrap());
            ((a - u) * (a - u) + (b - v) * (b - v)).sqrt()
        });
        assert!(moved.fold(0.0, f64::max) < 0.1);
    }
}

#[test]
fn hardly_any_texture_is_reported() {
    let Some(case) = load("tartanair-0180_0188") else { return };
    for base in [EstimateOptions::default(), paper()] {
        for options in seeds(&base) {
            let codes: Vec<_> = fit(&case, &options).warnings.iter().map(|w| w.code()).collect();
            assert!(codes.contains(&"few-inliers") || codes.contains(&"low-inlier-ratio"), "{codes:?}");
        }
    }
}

#[test]
fn good_pairs_are_not() {
    let others = ["nis-PTS_17", "mono-middlebury2003-Cones", "mono-middlebury2005-Art", "mono-icl-0025_0090"];
    for name in others.into_iter().chain(FLOORS.map(|(name, _)| name)) {
        let Some(case) = load(name) else { continue };
        for options in [EstimateOptions::default(), paper()] {
            assert_eq!(fit(&case, &options).warnings, [], "{name}");
        }
    }
}

#[test]
fn robust_fits_differ_as_in_the_paper() {
    let Some(case) = load("nis-PTS_17") else { return };
    let count = |robust_fit| inliers(&fit(&case, &EstimateOptions { robust_fit, ..paper() }));
    let [depth, one, several] = [RobustFit::Depth, RobustFit::Homography, RobustFit::MultiHomography].map(count);
    println!("inliers: depth {depth}, one homography {one}, several {several}");
    assert!(one < depth && depth < several + 50);
}
