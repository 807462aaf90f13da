//! Writes the sample scene as a case folder: `render-sample OUT_DIR [WIDTH HEIGHT]`.
#![allow(clippy::expect_used)]

#[path = "mod.rs"]
mod scene;

use std::error::Error;
use std::path::Path;

use depthstitch::geometry::Model;
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use scene::{MatchOptions, View};

/// Metres per unit of the 16-bit depth maps: up to 65 m.
const SCALE: f64 = 0.001;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (dir, width, height) = match args.as_slice() {
        [dir] => (dir, 960, 640),
        [dir, width, height] => (dir, width.parse()?, height.parse()?),
        _ => return Err("usage: render-sample OUT_DIR [WIDTH HEIGHT]".into()),
    };
    let dir = Path::new(dir);
    std::fs::create_dir_all(dir)?;
    let scene = scene::gallery();
    let pair = scene.render(width, height);
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

    if let Some(z) = view.depth.iter().find(|&&z| z / SCALE > f64::from(u16::MAX)) {
        return Err(format!("a depth of {z} m does not fit 16 bit").into());
    }
    let depth: Vec<u8> = view.depth.iter().flat_map(|z| ((z / SCALE).round() as u16).to_ne_bytes()).collect();
    let file = std::fs::File::create(dir.join(format!("{name}_depth.png")))?;
    PngEncoder::new(file).write_image(&depth, width, height, ExtendedColorType::L16)?;
    Ok(())
}
