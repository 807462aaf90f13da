//! Hashes of all that `stitch` or `stitch_many` makes natively of decoded inputs, as one line of JSON: `stitch-hash DIR`.
//!
//! DIR holds what `tests/node/identity.test.mjs` writes: raw little-endian arrays, and their sizes in `sizes.json`, a list of
//! many photos. Files are not decoded here, so that the core alone is compared with its wasm.
#![allow(clippy::expect_used)]

#[path = "mod.rs"]
mod fingerprint;

use std::path::Path;

use depthstitch::View;
use depthstitch::geometry::{Match, Model};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::pipeline::many::{ManyOptions, Photo, stitch_many};
use depthstitch::pipeline::{Options, stitch};
use depthstitch::{Image, InverseDepth};
use fingerprint::fingerprint;
use serde_json::{Value, json};

fn main() {
    let folder = std::env::args().nth(1).expect("usage: stitch-hash DIR");
    let folder = Path::new(&folder);
    let sizes: Value = serde_json::from_slice(&read(folder, "sizes.json")).expect("sizes.json is JSON");
    println!("{}", if sizes.is_array() { many(folder, &sizes) } else { pair(folder, &sizes) });
}

fn pair(folder: &Path, sizes: &Value) -> Value {
    let photo = |name: &str| photo(folder, name, &sizes[name]);
    let (target, reference) = (photo("target"), photo("reference"));
    let depth = |name: &str, photo: &Image| {
        let kind = if sizes[name]["kind"] == "metric" { DepthKind::Metric } else { DepthKind::Inverse };
        let raw = floats(&read(folder, name));
        InverseDepth::new("depth", &raw, size(&sizes[name]), kind, None, photo.size()).expect("a depth map")
    };
    let (target_depth, reference_depth) = (depth("targetDepth", &target), depth("referenceDepth", &reference));
    let matches: Vec<Match> = floats(&read(folder, "matches"))
        .as_chunks::<4>()
        .0
        .iter()
        .map(|m| m.map(f64::from))
        .map(|[a, b, c, d]| Match { target: [a, b], reference: [c, d] })
        .collect();

    let done = stitch(
        Some(&matches),
        View { image: target.view(), depth: Some(&target_depth) },
        View { image: reference.view(), depth: Some(&reference_depth) },
        &Options::default(),
        &mut (),
    )
    .expect("the case stitches");
    let inliers: Vec<u8> = done.geometry.inliers.iter().map(|&inlier| u8::from(inlier)).collect();
    let quality = done.quality;
    let numbers = [quality.psnr_bbox, quality.ssim_bbox, quality.psnr_mask, quality.ssim_mask, quality.coverage];
    json!({
        "mosaic": fnv(done.mosaic.image.data()),
        "voidMask": fnv(done.mosaic.voids.data()),
        "warped": fnv(done.warped.image.data()),
        "footprint": fnv(done.warped.footprint.data()),
        "inliers": fnv(&inliers),
        "forward": fnv(&model(&done.geometry.forward)),
        "reverse": fnv(&model(&done.geometry.reverse)),
        "quality": fnv(&bytes(numbers)),
    })
}

fn many(folder: &Path, sizes: &Value) -> Value {
    let sizes = sizes.as_array().expect("a list of photos");
    let images: Vec<Image> = sizes.iter().enumerate().map(|(i, size)| photo(folder, &i.to_string(), size)).collect();
    let photos: Vec<Photo<'_>> = images.iter().map(|image| Photo::new(image.view())).collect();
    let done = stitch_many(&photos, &ManyOptions::default(), &mut ()).expect("the set stitches");
    let cameras = done.photos.iter().flat_map(|photo| {
        let camera = photo.camera.expect("a camera");
        let pose = [camera.rotation.transpose().as_slice(), camera.translation.as_slice()].concat();
        pose.into_iter().chain([photo.focal.expect("a focal length")])
    });
    json!({
        "mosaic": fnv(done.image.data()),
        "labels": fnv(done.labels.data()),
        "voidMask": fnv(done.voids.data()),
        "cameras": fnv(&bytes(cameras)),
        "distortion": fnv(&bytes([done.distortion])),
    })
}

fn size(size: &Value) -> (usize, usize) {
    let side = |key: &str| size[key].as_u64().expect("a size") as usize;
    (side("width"), side("height"))
}

fn photo(folder: &Path, name: &str, of: &Value) -> Image {
    let (width, height) = size(of);
    Image::new(read(folder, name), width, height).expect("a photo")
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    let path = folder.join(name);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

/// H row by row, then e.
fn model(model: &Model) -> Vec<u8> {
    bytes(model.h.transpose().iter().chain(model.e.iter()).copied())
}

fn bytes(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

fn fnv(bytes: &[u8]) -> String {
    format!("{:016x}", fingerprint(bytes.iter().map(|&byte| u64::from(byte))))
}
