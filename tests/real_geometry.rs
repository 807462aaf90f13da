//! The robust fit on real and rendered pairs: the fitted map against the true one. Reads `DEPTHSTITCH_DATA`.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use depthstitch::InverseDepth;
use depthstitch::geometry::{
    Calibration, Estimate, EstimateOptions, Frame, Match, Model, ModelKind, RobustFit, Threshold, estimate,
};
use depthstitch::image::DepthKind;
use nalgebra::{Matrix3, Vector3};
use std::path::{Path, PathBuf};

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

struct Case {
    matches: Vec<Match>,
    depth: [InverseDepth; 2],
    truth: Option<Model>,
}

fn load(name: &str) -> Option<Case> {
    let root = std::env::var_os("DEPTHSTITCH_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let folder = root.join(name);
    let Ok(json) = std::fs::read_to_string(folder.join("case.json")) else {
        println!("skipped: no {}", folder.display());
        return None;
    };
    let depth = ["target_depth.png", "reference_depth.png"].map(|file| load_depth(&folder.join(file), &json));
    let table = std::fs::read_to_string(folder.join("matches.csv")).unwrap();
    let matches = table.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|n| n.trim().parse().unwrap()).collect();
        Match { target: [v[0], v[1]], reference: [v[2], v[3]] }
    });
    let truth = numbers(&json, "H_inf").zip(numbers(&json, "e_prime"));
    let truth = truth.map(|(h, e)| Model { h: Matrix3::from_row_slice(&h), e: Vector3::from_row_slice(&e) });
    Some(Case { matches: matches.collect(), depth, truth })
}

/// The numbers, in any nesting, of a field that holds nothing else.
fn numbers(json: &str, field: &str) -> Option<Vec<f64>> {
    let (_, value) = json.split_once(&format!("\"{field}\":"))?;
    let end = value.find(['"', '{', '}']).unwrap_or(value.len());
    let parts = value[..end].split([',', '[', ']']).map(str::trim).filter(|part| !part.is_empty());
    let found: Vec<f64> = parts.map_while(|part| part.parse().ok()).collect();
    (!found.is_empty()).then_some(found)
}

fn load_depth(file: &Path, json: &str) -> InverseDepth {
    let picture = image::open(file).unwrap();
    let size = (picture.width() as usize, picture.height() as usize);
    let raw: Vec<u16> = match picture {
        image::DynamicImage::ImageLuma8(p) => p.into_raw().into_iter().map(u16::from).collect(),
        p => p.into_luma16().into_raw(),
    };
    let kind = if json.contains("\"metric\"") { DepthKind::Metric } else { DepthKind::Inverse };
    let scale = numbers(json, "scale").unwrap()[0] as f32;
    let raw: Vec<f32> = raw.into_iter().map(|v| f32::from(v) * scale).collect();
    InverseDepth::new("depth", &raw, size, kind, numbers(json, "invalid").map(|v| v[0] as f32 * scale), size).unwrap()
}

impl Case {
    fn fit(&self, options: &EstimateOptions) -> Estimate {
        let [target, reference] = [0, 1]
            .map(|i| Frame { size: (self.depth[i].width(), self.depth[i].height()), depth: Some(&self.depth[i]) });
        estimate(&self.matches, target, reference, options, &mut ()).unwrap()
    }

    /// Median error of the map on every fourth pixel with depth, within the reference's frame and outside.
    fn errors(&self, model: &Model) -> [f64; 2] {
        let (truth, depth) = (self.truth.unwrap(), &self.depth[0]);
        let size = [self.depth[1].width() as f64, self.depth[1].height() as f64];
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
        let Some(case) = load(name) else { return };
        for options in seeds(&free()) {
            let found = case.fit(&options);
            let errors = case.errors(&found.forward);
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
        let Some(case) = load(name) else { return };
        for options in seeds(&EstimateOptions::default()) {
            let found = case.fit(&options);
            let errors = case.errors(&found.forward);
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
        let Some(case) = load(name) else { return };
        for calibration in [Calibration::Auto, Calibration::Always] {
            let of =
                |calibration| case.errors(&case.fit(&EstimateOptions { calibration, ..Default::default() }).forward)[0];
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
        let Some(case) = load(name) else { return };
        let all: Vec<[f64; 2]> = seeds(&paper()).map(|options| case.errors(&case.fit(&options).forward)).collect();
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
        let Some(case) = load(name) else { return };
        let found = inliers(&case.fit(&paper()));
        println!("{name}: {found} inliers");
        assert!(found + 2 >= expected, "{name}: {found}");
    }
}

#[test]
fn seed_hardly_moves_the_real_pair() {
    let Some(case) = load("nis-PTS_17") else { return };
    let first = case.fit(&EstimateOptions::default());
    for options in seeds(&EstimateOptions::default()) {
        let found = case.fit(&options);
        let moved = case.matches.iter().map(|m| {
            let [x, y] = m.target;
            let d = case.depth[0].sample(x, y);
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
            let codes: Vec<_> = case.fit(&options).warnings.iter().map(|w| w.code()).collect();
            assert!(codes.contains(&"few-inliers") || codes.contains(&"low-inlier-ratio"), "{codes:?}");
        }
    }
}

#[test]
fn good_pairs_are_not() {
    let others = ["nis-PTS_17", "mono-middlebury2003-Cones", "mono-middlebury2005-Art", "mono-icl-0025_0090"];
    for name in others.into_iter().chain(FLOORS.map(|(name, _)| name)) {
        let Some(case) = load(name) else { return };
        for options in [EstimateOptions::default(), paper()] {
            assert_eq!(case.fit(&options).warnings, [], "{name}");
        }
    }
}

#[test]
fn robust_fits_differ_as_in_the_paper() {
    let Some(case) = load("nis-PTS_17") else { return };
    let count = |robust_fit| inliers(&case.fit(&EstimateOptions { robust_fit, ..paper() }));
    let [depth, one, several] = [RobustFit::Depth, RobustFit::Homography, RobustFit::MultiHomography].map(count);
    println!("inliers: depth {depth}, one homography {one}, several {several}");
    assert!(one < depth && depth < several + 50);
}
