//! What goes back to JavaScript: plain objects with typed arrays of their own.

use js_sys::{Array, Float32Array, Float64Array, Object, Uint8Array, Uint32Array};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, image_to_js, put, sized};
use crate::features::{Features, Keypoint, Pair};
use crate::geometry::{Estimate, Match, Model, ModelKind};
use crate::image::marked;
use crate::metrics::Quality;
use crate::pipeline::Crops;
use crate::report::Warning;
use crate::warp::{Projection, Warped};
use crate::{Image, InverseDepth, Mask, Rect, Stage};

/// Which pictures and masks a result is to have, by the names of its fields.
pub(super) struct Outputs(Option<Array>);

impl Outputs {
    /// Whatever there is.
    pub const ALL: Self = Self(None);

    /// What the caller asks for; everything by default.
    pub fn of(inputs: &JsValue) -> Self {
        Self(get(inputs, "outputs").dyn_into().ok())
    }

    pub fn image(&self, to: &JsValue, name: &str, image: &Image) {
        self.put(to, name, &|| self::image(image));
    }

    fn mask(&self, to: &JsValue, name: &str, mask: &Mask) {
        self.put(to, name, &|| self::mask(mask));
    }

    fn put(&self, to: &JsValue, name: &str, value: &dyn Fn() -> JsValue) {
        if self.0.as_ref().is_none_or(|names| names.includes(&name.into(), 0)) {
            put(to, name, value());
        }
    }
}

/// An object of numbers.
pub(super) fn numbers(fields: &[(&str, f64)]) -> JsValue {
    let object = Object::new().into();
    fields.iter().for_each(|&(name, value)| put(&object, name, value.into()));
    object
}

/// Adds the fields of `Geometry` to `to`.
pub(super) fn add_geometry(to: &JsValue, geometry: &Estimate, warnings: &[Warning]) {
    let inliers: Vec<u8> = geometry.inliers.iter().map(|&inlier| u8::from(inlier)).collect();
    let count = marked(&inliers);
    let kind = match geometry.kind {
        ModelKind::Depth => "depth",
        ModelKind::Calibrated => "calibrated",
        ModelKind::TwoView => "two-view",
        ModelKind::Homography => "homography",
    };
    let report = numbers(&[
        ("matches", geometry.inliers.len() as f64),
        ("usable", geometry.usable as f64),
        ("inliers", count as f64),
        ("tracked", geometry.tracked as f64),
        ("threshold", geometry.threshold),
        ("trials", f64::from(geometry.trials)),
    ]);
    put(&report, "model", kind.into());
    put(&report, "residual", list(&geometry.residual));
    put(&report, "focalLength", geometry.focal.map_or(JsValue::NULL, JsValue::from));
    put(&report, "warnings", self::warnings(warnings));
    put(to, "forward", model(&geometry.forward));
    put(to, "reverse", model(&geometry.reverse));
    put(to, "inliers", Uint8Array::from(inliers.as_slice()).into());
    put(to, "report", report);
}

/// `Warning`s.
pub(super) fn warnings(warnings: &[Warning]) -> JsValue {
    let array = Array::new();
    for warning in warnings {
        let object = Object::new().into();
        put(&object, "code", warning.code().into());
        put(&object, "message", warning.message().into());
        array.push(&object);
    }
    array.into()
}

/// A `Features`.
pub(super) fn features(features: &Features) -> JsValue {
    let fields = |k: &Keypoint| [k.x, k.y, k.scale, k.angle, k.response];
    let keypoints: Vec<f32> = features.keypoints.iter().flat_map(fields).collect();
    let (width, height) = features.size;
    let object = numbers(&[("width", width as f64), ("height", height as f64)]);
    put(&object, "keypoints", Float32Array::from(keypoints.as_slice()).into());
    put(&object, "descriptors", Uint8Array::from(features.descriptors.as_flattened()).into());
    object
}

/// Adds the fields of `Matches` to `to`.
pub(super) fn add_matches(to: &JsValue, found: &[Match], pairs: &[Pair]) {
    let pairs: Vec<u32> = pairs.iter().flat_map(|pair| [pair.target, pair.reference]).collect();
    put(to, "matches", matches(found));
    put(to, "pairs", Uint32Array::from(pairs.as_slice()).into());
}

/// xt, yt, xr, yr of every match.
pub(super) fn matches(matches: &[Match]) -> JsValue {
    let numbers = |m: &Match| [m.target[0], m.target[1], m.reference[0], m.reference[1]].map(|v| v as f32);
    let flat: Vec<f32> = matches.iter().flat_map(numbers).collect();
    Float32Array::from(flat.as_slice()).into()
}

/// Adds the fields of `Warped` to `to`.
pub(super) fn add_warped(to: &JsValue, warped: &Warped, outputs: &Outputs) {
    outputs.image(to, "warped", &warped.image);
    outputs.mask(to, "footprint", &warped.footprint);
    if let Some(confidence) = &warped.confidence {
        outputs.mask(to, "confidence", confidence);
    }
    put(to, "offset", numbers(&[("x", warped.offset.0 as f64), ("y", warped.offset.1 as f64)]));
    put(to, "clipped", warped.clipped.into());
}

pub(super) fn projection(projection: Projection) -> JsValue {
    let name = match projection {
        Projection::Plane => "plane",
        Projection::Cylinder => "cylinder",
        Projection::Sphere => "sphere",
    };
    name.into()
}

/// Adds the fields of `Mosaic` to `to`.
pub(super) fn add_mosaic(to: &JsValue, mosaic: &crate::mosaic::Mosaic, outputs: &Outputs) {
    outputs.image(to, "mosaic", &mosaic.image);
    outputs.mask(to, "voidMask", &mosaic.voids);
    outputs.mask(to, "seam", &mosaic.seam);
    put(to, "gains", list(&mosaic.gains));
}

pub(super) fn quality(quality: &Quality) -> JsValue {
    numbers(&[
        ("psnrBbox", quality.psnr_bbox),
        ("ssimBbox", quality.ssim_bbox),
        ("psnrMask", quality.psnr_mask),
        ("ssimMask", quality.ssim_mask),
        ("coverage", quality.coverage),
    ])
}

pub(super) fn times(times: &[(Stage, f64)]) -> JsValue {
    let object = Object::new().into();
    times.iter().for_each(|&(stage, ms)| put(&object, stage.name(), ms.into()));
    object
}

pub(super) fn image(image: &Image) -> JsValue {
    image_to_js(image.data(), image.width(), image.height())
}

/// Adds the inverse depth of the target (0) or the reference (1) to `to`.
pub(super) fn put_depth(to: &JsValue, side: usize, map: &InverseDepth) {
    put(to, ["targetDepth", "referenceDepth"][side], depth(map));
}

/// The rectangles of a mosaic.
pub(super) fn crops(crops: &Crops) -> JsValue {
    let object = Object::new().into();
    for (name, rect) in [("inner", crops.inner), ("bounds", crops.bounds)] {
        let sides = |r: Rect| [("x", r.x), ("y", r.y), ("width", r.width), ("height", r.height)];
        let rect = rect.map(|rect| numbers(&sides(rect).map(|(name, side)| (name, side as f64))));
        put(&object, name, rect.unwrap_or(JsValue::NULL));
    }
    object
}

/// A `DepthOutput`.
pub(super) fn depth(depth: &InverseDepth) -> JsValue {
    let js = sized(Float32Array::from(depth.data()).into(), depth.width(), depth.height());
    put(&js, "kind", "inverse".into());
    js
}

pub(super) fn mask(mask: &Mask) -> JsValue {
    sized(Uint8Array::from(mask.data()).into(), mask.width(), mask.height())
}

pub(super) fn model(model: &Model) -> JsValue {
    let object = Object::new().into();
    // The matrix is stored column by column.
    put(&object, "h", Float64Array::from(model.h.transpose().as_slice()).into());
    put(&object, "e", Float64Array::from(model.e.as_slice()).into());
    object
}

/// An array of numbers.
pub(super) fn list(numbers: &[f64]) -> JsValue {
    let array = Array::new();
    for &number in numbers {
        array.push(&number.into());
    }
    array.into()
}
