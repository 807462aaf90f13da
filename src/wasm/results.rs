//! What goes back to JavaScript: plain objects with typed arrays of their own.

use std::borrow::Borrow;

use js_sys::{Array, Float32Array, Float64Array, Object, Uint8Array, Uint32Array};
use wasm_bindgen::JsValue;

use super::convert::{image_to_js, set, sized};
use crate::features::{Features, Keypoint, Pair};
use crate::geometry::{Estimate, Match, Model, ModelKind};
use crate::metrics::Quality;
use crate::mosaic::Rect;
use crate::pipeline::Crops;
use crate::report::Warning;
use crate::warp::Warped;
use crate::{Image, InverseDepth, Mask, Stage};

/// An object from names and values.
fn object(fields: &[(&str, JsValue)]) -> JsValue {
    let object = Object::new();
    fields.iter().for_each(|(name, value)| set(&object, name, value));
    object.into()
}

/// Adds the fields of `Geometry` to `to`.
pub(super) fn add_geometry(to: &JsValue, geometry: &Estimate, warnings: &[Warning]) {
    let inliers: Vec<u8> = geometry.inliers.iter().map(|&inlier| u8::from(inlier)).collect();
    let count = inliers.iter().filter(|&&inlier| inlier != 0).count();
    let kind = match geometry.kind {
        ModelKind::Depth => "depth",
        ModelKind::Calibrated => "calibrated",
        ModelKind::TwoView => "two-view",
        ModelKind::Homography => "homography",
    };
    let remarks: Array = warnings
        .iter()
        .map(|warning| object(&[("code", warning.code().into()), ("message", warning.message().into())]))
        .collect();
    let report = object(&[
        ("model", kind.into()),
        ("matches", geometry.inliers.len().into()),
        ("usable", geometry.usable.into()),
        ("inliers", count.into()),
        ("threshold", geometry.threshold.into()),
        ("trials", geometry.trials.into()),
        ("residual", Array::of2(&geometry.residual[0].into(), &geometry.residual[1].into()).into()),
        ("focalLength", geometry.focal.map_or(JsValue::NULL, JsValue::from)),
        ("warnings", remarks.into()),
    ]);
    set(to, "forward", &model(&geometry.forward));
    set(to, "reverse", &model(&geometry.reverse));
    set(to, "inliers", &Uint8Array::from(inliers.as_slice()));
    set(to, "report", &report);
}

/// A `Features`.
pub(super) fn features(features: &Features) -> JsValue {
    let numbers = |k: &Keypoint| [k.x, k.y, k.scale, k.angle, k.response];
    let keypoints: Vec<f32> = features.keypoints.iter().flat_map(numbers).collect();
    let (width, height) = features.size;
    object(&[
        ("keypoints", Float32Array::from(keypoints.as_slice()).into()),
        ("descriptors", Uint8Array::from(features.descriptors.as_flattened()).into()),
        ("width", width.into()),
        ("height", height.into()),
    ])
}

/// Adds the fields of `Matches` to `to`.
pub(super) fn add_matches(to: &JsValue, found: &[Match], pairs: &[Pair]) {
    let pairs: Vec<u32> = pairs.iter().flat_map(|pair| [pair.target, pair.reference]).collect();
    set(to, "matches", &matches(found));
    set(to, "pairs", &Uint32Array::from(pairs.as_slice()));
}

/// xt, yt, xr, yr of every match.
pub(super) fn matches(matches: &[Match]) -> JsValue {
    let numbers = |m: &Match| [m.target[0], m.target[1], m.reference[0], m.reference[1]].map(|v| v as f32);
    let flat: Vec<f32> = matches.iter().flat_map(numbers).collect();
    Float32Array::from(flat.as_slice()).into()
}

/// Adds the fields of `Warped` to `to`.
pub(super) fn add_warped(to: &JsValue, warped: &Warped) {
    let offset = object(&[("x", warped.offset.0.into()), ("y", warped.offset.1.into())]);
    set(to, "warped", &image(&warped.image));
    set(to, "footprint", &mask(&warped.footprint));
    set(to, "offset", &offset);
    set(to, "clipped", &warped.clipped.into());
}

/// Adds the fields of `Mosaic` to `to`.
pub(super) fn add_mosaic(to: &JsValue, mosaic: &crate::mosaic::Mosaic) {
    set(to, "mosaic", &image(&mosaic.image));
    set(to, "voidMask", &mask(&mosaic.voids));
    set(to, "seam", &mask(&mosaic.seam));
    let [red, green, blue] = mosaic.gains;
    set(to, "gains", &Array::of3(&red.into(), &green.into(), &blue.into()));
}

pub(super) fn quality(quality: &Quality) -> JsValue {
    object(&[
        ("psnrBbox", quality.psnr_bbox.into()),
        ("ssimBbox", quality.ssim_bbox.into()),
        ("psnrMask", quality.psnr_mask.into()),
        ("ssimMask", quality.ssim_mask.into()),
        ("coverage", quality.coverage.into()),
    ])
}

pub(super) fn times(times: &[(Stage, f64)]) -> JsValue {
    let to = Object::new();
    times.iter().for_each(|(stage, ms)| set(&to, stage.name(), &(*ms).into()));
    to.into()
}

pub(super) fn image(image: &Image) -> JsValue {
    image_to_js(&image.data, image.width, image.height)
}

/// Adds the inverse depth of target and reference, as far as there is any, to `to`.
pub(super) fn add_depth(to: &JsValue, maps: &[Option<impl Borrow<InverseDepth>>; 2]) {
    for (name, map) in ["targetDepth", "referenceDepth"].into_iter().zip(maps) {
        if let Some(map) = map {
            set(to, name, &depth(map.borrow()));
        }
    }
}

/// The rectangles of a mosaic.
pub(super) fn crops(crops: &Crops) -> JsValue {
    let rect = |rect: Option<Rect>| {
        rect.map_or(JsValue::NULL, |r| {
            object(&[("x", r.x.into()), ("y", r.y.into()), ("width", r.width.into()), ("height", r.height.into())])
        })
    };
    object(&[("inner", rect(crops.inner)), ("bounds", rect(crops.bounds))])
}

/// A `DepthOutput`.
fn depth(depth: &InverseDepth) -> JsValue {
    let data = Float32Array::from(depth.data());
    let js = sized(&data, depth.width(), depth.height());
    set(&js, "kind", &"inverse".into());
    js
}

pub(super) fn mask(mask: &Mask) -> JsValue {
    sized(&Uint8Array::from(mask.data.as_slice()), mask.width, mask.height)
}

fn model(model: &Model) -> JsValue {
    let h: [f64; 9] = std::array::from_fn(|i| model.h[(i / 3, i % 3)]);
    object(&[("h", Float64Array::from(h.as_slice()).into()), ("e", Float64Array::from(model.e.as_slice()).into())])
}
