//! Writes the sample scene as a case folder: `render-sample OUT_DIR [WIDTH HEIGHT [COUNT]]`. With a count it is that many photos of
//! somebody who walks past and looks around.
#![allow(clippy::expect_used)]

use std::error::Error;
use std::path::Path;

use depthstitch::geometry::Model;
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use scene::{Camera, MatchOptions, Pair, View, Views};

/// Metres per unit of the 16-bit depth maps: up to 65 m.
const SCALE: f64 = 0.001;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (dir, width, height, count) = match args.as_slice() {
        [dir] => (dir, 960, 640, None),
        [dir, width, height] => (dir, width.parse()?, height.parse()?, None),
        [dir, width, height, count] => (dir, width.parse()?, height.parse()?, Some(count.parse()?)),
        _ => return Err("usage: render-sample OUT_DIR [WIDTH HEIGHT [COUNT]]".into()),
    };
    let dir = Path::new(dir);
    std::fs::create_dir_all(dir)?;
    match count {
        Some(count) => write_many(dir, &scene::walk(count, width, height)),
        None => write_pair(dir, &scene::gallery().render(width, height)),
    }
}

/// A case of many photos.
fn write_many(dir: &Path, views: &Views) -> Result<(), Box<dyn Error>> {
    let (mut photos, mut depths, mut cameras) = (Vec::new(), Vec::new(), Vec::new());
    for (i, view) in views.0.iter().enumerate() {
        write_view(dir, &format!("{i:02}"), view)?;
        photos.push(format!("{i:02}.jpg"));
        depths.push(format!("{i:02}_depth.png"));
        let Camera { k, r, centre, .. } = view.camera;
        let numbers = |m: &[f64]| m.to_vec();
        cameras.push(serde_json::json!({
            "K": numbers(k.transpose().as_slice()),
            "R": numbers(r.transpose().as_slice()),
            "t": numbers((-(r * centre)).as_slice()),
        }));
    }
    let case = serde_json::json!({
        "name": "walk",
        "photos": photos,
        "depth": { "files": depths, "kind": "metric", "scale": SCALE, "invalid": 0 },
        "truth": { "cameras": cameras },
    });
    std::fs::write(dir.join("case.json"), serde_json::to_string_pretty(&case)?)?;
    Ok(())
}

fn write_pair(dir: &Path, pair: &Pair<'_>) -> Result<(), Box<dyn Error>> {
    write_view(dir, "target", &pair.target)?;
    write_view(dir, "reference", &pair.reference)?;

    let sampled = pair.matches(&MatchOptions { count: 600, sigma: 0.3, outliers: 0.1, seed: 1 });
    let mut csv = String::from("xt,yt,xr,yr\n");
    for m in &sampled.matches {
        csv += &format!("{:.3},{:.3},{:.3},{:.3}\n", m.target[0], m.target[1], m.reference[0], m.reference[1]);
    }
    std::fs::write(dir.join("matches.csv"), csv)?;

    let k = pair.target.camera.k;
    let rows = |m: &nalgebra::Matrix3<f64>| {
        let row = |i: usize| format!("[{:?}, {:?}, {:?}]", m[(i, 0)], m[(i, 1)], m[(i, 2)]);
        format!("[{}, {}, {}]", row(0), row(1), row(2))
    };
    let epipole = |m: &Model| format!("[{:?}, {:?}, {:?}]", m.e[0], m.e[1], m.e[2]);
    let json = format!(
        r#"{{
  "name": "gallery",
  "target": "target.jpg",
  "reference": "reference.jpg",
  "target_depth": "target_depth.png",
  "reference_depth": "reference_depth.png",
  "matches": "matches.csv",
  "depth": {{ "kind": "metric", "scale": {SCALE}, "invalid": 0 }},
  "truth": {{
    "H_inf": {},
    "e_prime": {},
    "H_inf_reverse": {},
    "e_prime_reverse": {},
    "K": {}
  }}
}}
"#,
        rows(&pair.forward.h),
        epipole(&pair.forward),
        rows(&pair.reverse.h),
        epipole(&pair.reverse),
        rows(&k),
    );
    std::fs::write(dir.join("case.json"), json)?;
    Ok(())
}

fn write_view(dir: &Path, name: &str, view: &View) -> Result<(), Box<dyn Error>> {
    let (width, height) = (view.width as u32, view.height as u32);
    let rgb: Vec<u8> = view.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let file = std::fs::File::create(dir.join(format!("{name}.jpg")))?;
    JpegEncoder::new_with_quality(file, 92).write_image(&rgb, width, height, ExtendedColorType::Rgb8)?;

    // What is too far away for 16 bits is unknown: 0.
    let code = |z: &f64| Some((z / SCALE).round()).filter(|v| *v <= f64::from(u16::MAX)).map_or(0, |v| v as u16);
    let depth: Vec<u8> = view.depth.iter().flat_map(|z| code(z).to_ne_bytes()).collect();
    let file = std::fs::File::create(dir.join(format!("{name}_depth.png")))?;
    PngEncoder::new(file).write_image(&depth, width, height, ExtendedColorType::L16)?;
    Ok(())
}
