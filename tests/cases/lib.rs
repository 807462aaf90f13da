//! Loads a case folder: photos, depth maps, matches and, where there is one, the true map.

use std::io::Write;
use std::path::{Path, PathBuf};

use depthstitch::geometry::{Match, Model};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::{Image, InverseDepth};
use nalgebra::{Matrix3, Vector3};
use scene::Photos;
use serde_json::Value;

/// A case, ready for the stages.
pub struct Case {
    pub photos: Photos,
    /// The true map from target to reference.
    pub truth: Option<Model>,
}

/// Where the real cases are without `DEPTHSTITCH_DATA`, from this crate's folder.
const DATA: &str = "../../../shared/data";

/// Folder of the real case of this name; `None`, said aloud, where there is none.
pub fn real_case(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DEPTHSTITCH_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(DATA), PathBuf::from);
    let folder = root.join(name);
    if folder.join("case.json").is_file() {
        return Some(folder);
    }
    // What is printed in the usual way is only shown of tests that fail.
    let message = format!("skipped: no {} (set DEPTHSTITCH_DATA)\n", folder.display());
    let _ = std::io::stderr().write_all(message.as_bytes());
    None
}

/// Reads the case in `folder`. Panics with the reason: for tests and benchmarks only.
pub fn load(folder: &Path) -> Case {
    let text = std::fs::read_to_string(folder.join("case.json")).expect("case.json");
    let json: Value = serde_json::from_str(&text).expect("case.json is JSON");
    let file = |key: &str| folder.join(json[key].as_str().unwrap_or_else(|| panic!("case.json has no {key}")));
    let (target, reference) = (photo(&file("target")), photo(&file("reference")));
    let depth =
        |key: &str, image: &Image| json["depth"].is_object().then(|| depth(&file(key), &json["depth"], image.size()));
    let photos = Photos {
        target_depth: depth("target_depth", &target),
        reference_depth: depth("reference_depth", &reference),
        matches: matches(&file("matches")),
        target,
        reference,
    };
    Case { photos, truth: json.get("truth").filter(|truth| truth.is_object()).map(truth) }
}

fn photo(path: &Path) -> Image {
    let image = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).into_rgba8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Image::new(image.into_raw(), width, height).expect("a photo")
}

fn depth(path: &Path, json: &Value, size: (usize, usize)) -> InverseDepth {
    let image = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let own_size = (image.width() as usize, image.height() as usize);
    let raw: Vec<f32> = match image {
        image::DynamicImage::ImageLuma16(image) => image.into_raw().into_iter().map(f32::from).collect(),
        other => other.into_luma8().into_raw().into_iter().map(f32::from).collect(),
    };
    let scale = json["scale"].as_f64().unwrap_or(1.0);
    let invalid = json["invalid"].as_f64();
    let scaled: Vec<f32> = raw
        .iter()
        .map(|&v| if invalid == Some(f64::from(v)) { f32::NAN } else { (f64::from(v) * scale) as f32 })
        .collect();
    let kind = if json["kind"] == "metric" { DepthKind::Metric } else { DepthKind::Inverse };
    InverseDepth::new("depth", &scaled, own_size, kind, None, size).expect("a depth map")
}

fn matches(path: &Path) -> Vec<Match> {
    let text = std::fs::read_to_string(path).expect("matches.csv");
    let number = |v: &str| v.trim().parse::<f64>().expect("a number");
    text.lines()
        .skip(1)
        .filter(|line| !line.trim().is_empty())
        .map(|line| {
            let v: Vec<f64> = line.split(',').map(number).collect();
            Match { target: [v[0], v[1]], reference: [v[2], v[3]] }
        })
        .collect()
}

fn truth(json: &Value) -> Model {
    fn flatten(value: &Value, out: &mut Vec<f64>) {
        match value {
            Value::Array(items) => items.iter().for_each(|item| flatten(item, out)),
            other => out.extend(other.as_f64()),
        }
    }
    let numbers = |key: &str| {
        let mut out = Vec::new();
        flatten(&json[key], &mut out);
        out
    };
    Model { h: Matrix3::from_row_slice(&numbers("H_inf")), e: Vector3::from_column_slice(&numbers("e_prime")) }
}
