//! What goes back to JavaScript: plain objects with typed arrays of their own.

use js_sys::{Array, Float64Array, Object, Uint8Array};
use wasm_bindgen::JsValue;

use super::convert::{image_to_js, set, sized};
use crate::geometry::{Estimate, Model, ModelKind};
use crate::metrics::Quality;
use crate::report::Warning;
use crate::warp::Warped;
use crate::{Image, Mask, Stage};

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
        ("warnings", remarks.into()),
    ]);
    set(to, "forward", &model(&geometry.forward));
    set(to, "reverse", &model(&geometry.reverse));
    set(to, "inliers", &Uint8Array::from(inliers.as_slice()));
    set(to, "report", &report);
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

fn mask(mask: &Mask) -> JsValue {
    sized(&Uint8Array::from(mask.data.as_slice()), mask.width, mask.height)
}

fn model(model: &Model) -> JsValue {
    let h: [f64; 9] = std::array::from_fn(|i| model.h[(i / 3, i % 3)]);
    object(&[("h", Float64Array::from(h.as_slice()).into()), ("e", Float64Array::from(model.e.as_slice()).into())])
}
