//! Photos, depth maps, matches and models from JavaScript.

use js_sys::{Float32Array, Float64Array, Uint8Array, Uint16Array};
use nalgebra::{Matrix3, Vector3};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, image_from_js, invalid, mask_from_js, size_from_js, whole};
use crate::features::{Features, Keypoint};
use crate::geometry::{Match, Model};
use crate::image::{DepthKind, check_len, reserve, zeroed};
use crate::mosaic::Mosaic;
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

fn floats(array: &Float32Array) -> Result<Vec<f32>> {
    let mut floats = zeroed(array.length() as usize)?;
    array.copy_to(&mut floats);
    Ok(floats)
}

fn check_length(name: &'static str, actual: u32, expected: usize) -> Result<()> {
    let (expected, actual) = (expected as u64, u64::from(actual));
    if actual == expected { Ok(()) } else { Err(Error::SizeMismatch { name, expected, actual }.into()) }
}

/// A `Features`.
pub(super) fn features(name: &'static str, value: &JsValue) -> Result<Features> {
    let size = size_from_js(name, value)?;
    let (keypoints, descriptors) = (get(value, "keypoints"), get(value, "descriptors"));
    let (Some(keypoints), Some(descriptors)) =
        (keypoints.dyn_ref::<Float32Array>(), descriptors.dyn_ref::<Uint8Array>())
    else {
        return Err(invalid(name, "an object whose keypoints are a Float32Array and descriptors a Uint8Array", value));
    };
    let count = descriptors.length() as usize / 128;
    check_length(name, descriptors.length(), 128 * count)?;
    check_length(name, keypoints.length(), 5 * count)?;
    let numbers = floats(keypoints)?;
    let mut descriptor_bytes: Vec<[u8; 128]> = zeroed(count)?;
    descriptors.copy_to(descriptor_bytes.as_flattened_mut());
    let keypoint = |&[x, y, scale, angle, response]: &[f32; 5]| Keypoint { x, y, scale, angle, response };
    Ok(Features {
        keypoints: numbers.as_chunks().0.iter().map(keypoint).collect(),
        descriptors: descriptor_bytes,
        size,
    })
}

/// Matches from a `Float32Array` of xt, yt, xr, yr.
pub(super) fn matches(value: &JsValue) -> Result<Vec<Match>> {
    let name = "matches";
    let Some(array) = value.dyn_ref::<Float32Array>() else {
        return Err(invalid(name, "a Float32Array of xt, yt, xr, yr", value));
    };
    check_length(name, array.length(), array.length() as usize / 4 * 4)?;
    let flat = floats(array)?;
    let mut out = Vec::new();
    reserve(&mut out, flat.len() / 4)?;
    for &[xt, yt, xr, yr] in flat.as_chunks().0 {
        out.push(Match { target: [xt.into(), yt.into()], reference: [xr.into(), yr.into()] });
    }
    Ok(out)
}

/// The matches among the inputs, where there are any.
pub(super) fn optional_matches(inputs: &JsValue) -> Result<Option<Vec<Match>>> {
    Some(get(inputs, "matches")).filter(is_given).map(|given| matches(&given)).transpose()
}

/// A `Model`.
pub(super) fn model(name: &'static str, value: &JsValue) -> Result<Model> {
    let numbers = |key: &str, numbers: &mut [f64]| {
        let array = get(value, key);
        let Some(array) = array.dyn_ref::<Float64Array>() else {
            return Err(invalid(name, "an object whose h and e are Float64Arrays", value));
        };
        check_length(name, array.length(), numbers.len())?;
        array.copy_to(numbers);
        Ok(())
    };
    let (mut h, mut e) = ([0.0; 9], [0.0; 3]);
    numbers("h", &mut h)?;
    numbers("e", &mut e)?;
    Ok(Model { h: Matrix3::from_row_slice(&h), e: Vector3::from(e) })
}

/// A `Mosaic`, as far as it is looked at.
pub(super) fn mosaic(value: &JsValue) -> Result<Mosaic> {
    Ok(Mosaic {
        image: image("mosaic", &get(value, "mosaic"))?,
        voids: mask("voidMask", &get(value, "voidMask"))?,
        seam: mask("seam", &get(value, "seam"))?,
        gains: [1.0; 3],
    })
}

/// Gains of red, green and blue; 1 where none are given.
pub(super) fn gains(value: &JsValue) -> Result<[f64; 3]> {
    let Some(array) = value.dyn_ref::<js_sys::Array>() else { return Ok([1.0; 3]) };
    check_length("gains", array.length(), 3)?;
    Ok([0, 1, 2].map(|c| array.get(c).as_f64().unwrap_or(f64::NAN)))
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
