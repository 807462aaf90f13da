//! Photos, depth maps, models and canvases from JavaScript.

use js_sys::{Float32Array, Float64Array, Uint8Array, Uint16Array};
use nalgebra::{Matrix3, Vector3};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, image_from_js, invalid, mask_from_js, size_from_js, whole};
use crate::geometry::Model;
use crate::image::{check_len, zeroed};
use crate::inverse_depth::DepthKind;
use crate::warp::Warped;
use crate::{Error, Image, InverseDepth, Mask, Result};

/// An owned photo or canvas.
pub(super) fn image(name: &'static str, value: &JsValue) -> Result<Image> {
    let (data, width, height) = image_from_js(name, value)?;
    Image::new(data, width, height)
}

/// An owned mask.
pub(super) fn mask(name: &'static str, value: &JsValue) -> Result<Mask> {
    let (data, width, height) = mask_from_js(name, value)?;
    Mask::new(data, width, height)
}

/// Whether an optional input is there; null stands for none.
pub(super) fn is_given(value: &JsValue) -> bool {
    !value.is_undefined() && !value.is_null()
}

/// A `DepthInput` for a photo of `size`; `None` where there is none.
pub(super) fn depth(name: &'static str, value: &JsValue, size: (usize, usize)) -> Result<Option<InverseDepth>> {
    if !is_given(value) {
        return Ok(None);
    }
    let (width, height) = size_from_js(name, value)?;
    let kind = get(value, "kind");
    let kind = match kind.as_string().as_deref() {
        Some("inverse") => DepthKind::Inverse,
        Some("metric") => DepthKind::Metric,
        _ => return Err(invalid(name, "an object whose kind is 'inverse' or 'metric'", &kind)),
    };
    let data = get(value, "data");
    if !data.is_instance_of::<Float32Array>()
        && !data.is_instance_of::<Uint16Array>()
        && !data.is_instance_of::<Uint8Array>()
    {
        return Err(invalid(name, "an object whose data is a Float32Array, Uint16Array or Uint8Array", &data));
    }
    // Read as floats, whichever they are: `set` converts.
    let data: &Float32Array = data.unchecked_ref();
    check_len(name, data.length() as usize, width, height, 1)?;
    let invalid = get(value, "invalid").as_f64().map(|v| v as f32);
    InverseDepth::new(name, &floats(data)?, (width, height), kind, invalid, size).map(Some)
}

/// An owned copy.
pub(super) fn floats(array: &Float32Array) -> Result<Vec<f32>> {
    let mut floats = zeroed(array.length() as usize)?;
    array.copy_to(&mut floats);
    Ok(floats)
}

/// Refuses an array of another length.
pub(super) fn check_length(name: &'static str, actual: u32, expected: usize) -> Result<()> {
    let (expected, actual) = (expected as u64, u64::from(actual));
    if actual == expected { Ok(()) } else { Err(Error::SizeMismatch { name, expected, actual }.into()) }
}

/// As many numbers as there is room for, of a property of `value`.
pub(super) fn numbers(name: &'static str, value: &JsValue, key: &str, numbers: &mut [f64]) -> Result<()> {
    let array = get(value, key);
    let Some(array) = array.dyn_ref::<Float64Array>() else {
        return Err(invalid(name, "an object of Float64Arrays", value));
    };
    check_length(name, array.length(), numbers.len())?;
    array.copy_to(numbers);
    Ok(())
}

/// A `Model`.
pub(super) fn model(name: &'static str, value: &JsValue) -> Result<Model> {
    let (mut h, mut e) = ([0.0; 9], [0.0; 3]);
    numbers(name, value, "h", &mut h)?;
    numbers(name, value, "e", &mut e)?;
    Ok(Model { h: Matrix3::from_row_slice(&h), e: Vector3::from(e) })
}

/// A `Warped`.
pub(super) fn warped(value: &JsValue) -> Result<Warped> {
    let offset = get(value, "offset");
    let side = |key: &str| whole(&get(&offset, key), 0.0, "offset", "two whole numbers of at least 0");
    Ok(Warped {
        image: image("warped", &get(value, "warped"))?,
        footprint: mask("footprint", &get(value, "footprint"))?,
        confidence: match get(value, "confidence") {
            none if none.is_undefined() => None,
            confidence => Some(mask("confidence", &confidence)?),
        },
        depth: None,
        offset: (side("x")?, side("y")?),
        clipped: get(value, "clipped").is_truthy(),
    })
}
