//! The exports of the evaluation's module, which is no part of the package. Every error is of stage `measure`.

use js_sys::Object;
use wasm_bindgen::prelude::*;

use super::convert::{get, put, to_js_error};
use super::inputs;
use crate::features::{LineSegmentOptions, line_segments};
use crate::metrics::{self, Appearance, LineBreaks};
use crate::mosaic::Mosaic;
use crate::{Result, Stage, View};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("evaluation.d.ts");

/// What a person sees of a mosaic.
#[wasm_bindgen(unchecked_return_type = "Appearance")]
pub fn appearance(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] target: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] reference: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "StitchResult")] result: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    evaluated(&|| measured(target, reference, result))
}

/// Shares of the seams between photos, and of all other places, with a step that shows; null where there is hardly any to judge.
#[wasm_bindgen(js_name = visibleSteps, unchecked_return_type = "VisibleSteps")]
pub fn visible_steps(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] mosaic: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Mask")] labels: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    evaluated(&|| {
        let (mosaic, labels) = (inputs::image("mosaic", mosaic)?, inputs::mask("labels", labels)?);
        let found = metrics::visible_steps(mosaic.view(), &labels)?;
        let object = Object::new().into();
        put(&object, "seam", or_null(found.seam));
        put(&object, "elsewhere", or_null(found.elsewhere));
        Ok(object)
    })
}

/// How many straight lines of a photo there are, and how many of them its map into the reference breaks.
#[wasm_bindgen(js_name = brokenLines, unchecked_return_type = "LineBreaks")]
pub fn broken_lines(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] photo: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Model")] forward: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "DepthInput | undefined")] depth: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    evaluated(&|| {
        let photo = inputs::image("photo", photo)?;
        let depth = inputs::depth("inverseDepth", depth, photo.size())?;
        let segments = line_segments(photo.view(), &LineSegmentOptions::default())?;
        let forward = inputs::model("forward", forward)?;
        let found = metrics::broken_lines(&segments, photo.size(), &forward, depth.as_ref(), photo.size());
        let all = [found.inside, found.across, found.outside];
        let sum = |count: fn(&LineBreaks) -> usize| all.iter().map(count).sum::<usize>() as f64;
        let object = Object::new().into();
        put(&object, "lines", sum(|breaks| breaks.lines).into());
        put(&object, "broken", sum(|breaks| breaks.broken).into());
        Ok(object)
    })
}

/// Runs `f` and turns its error into a JavaScript one.
fn evaluated(f: &dyn Fn() -> Result<JsValue>) -> std::result::Result<JsValue, JsValue> {
    f().map_err(|error| to_js_error(&error, Stage::Measure.name()))
}

fn measured(target: &JsValue, reference: &JsValue, result: &JsValue) -> Result<JsValue> {
    let (target, reference) = (inputs::image("target", target)?, inputs::image("reference", reference)?);
    let depth = inputs::depth("targetDepth", &get(result, "targetDepth"), target.size())?;
    let forward = inputs::model("forward", &get(result, "forward"))?;
    let (warped, mosaic) = (inputs::warped(result)?, mosaic(result)?);
    let target = View { image: target.view(), depth: depth.as_ref() };
    Ok(to_js(&metrics::appearance(target, reference.view(), &forward, &warped, &mosaic)?))
}

/// A `Mosaic`, as far as it is looked at.
fn mosaic(value: &JsValue) -> Result<Mosaic> {
    Ok(Mosaic {
        image: inputs::image("mosaic", &get(value, "mosaic"))?,
        voids: inputs::mask("voidMask", &get(value, "voidMask"))?,
        seam: inputs::mask("seam", &get(value, "seam"))?,
        gains: [1.0; 3],
    })
}

fn to_js(seen: &Appearance) -> JsValue {
    let lines = &seen.broken_lines;
    let object = Object::new().into();
    for (name, value) in [
        ("borderVoids", Some(seen.voids.border)),
        ("overlapVoids", Some(seen.voids.overlap)),
        ("seamOnBorder", seen.seam.on_border),
        ("seamLength", Some(seen.seam.length)),
        ("visibleSteps", seen.visible_steps.seam),
        ("stepsElsewhere", seen.visible_steps.elsewhere),
        ("brokenInside", lines.inside.share()),
        ("brokenAcross", lines.across.share()),
        ("brokenOutside", lines.outside.share()),
        ("bending", seen.bending),
    ] {
        put(&object, name, or_null(value));
    }
    object
}

/// Null where there is too little to judge.
fn or_null(value: Option<f64>) -> JsValue {
    value.map_or(JsValue::NULL, JsValue::from)
}
