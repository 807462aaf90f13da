//! Photos, depth maps, matches and models from JavaScript.

use js_sys::{Float32Array, Float64Array, Uint8Array, Uint16Array};
use nalgebra::{Matrix3, Vector3};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, image_from_js, mask_from_js, size_from_js};
use crate::features::{Features, Keypoint};
use crate::geometry::{Match, Model};
use crate::image::{DepthKind, check_len, reserve, zeroed};
use crate::warp::Warped;
use crate::{Error, Image, InverseDepth, Mask, Result};

/// An owned photo or canvas.
pub(super) fn image(name: &'static str, value: &JsValue) -> Result<Image> {
    let (data, width, height) = image_from_js(name, value)?;
    Ok(Image { data, width, height })
}

/// An owned mask.
pub(super) fn mask(name: &'static str, value: &JsValue) -> Result<Mask> {
    let (data, width, height) = mask_from_js(name, value)?;
    Ok(Mask { data, width, height })
}

/// A `DepthInput` for a photo of `size`; `None` where there is none.
pub(super) fn depth(name: &'static str, value: &JsValue, size: (usize, usize)) -> Result<Option<InverseDepth>> {
    if value.is_undefined() || value.is_null() {
        return Ok(None);
    }
    let (width, height) = size_from_js(name, value)?;
    let kind = match get(value, "kind").as_string().as_deref() {
        Some("inverse") => DepthKind::Inverse,
        Some("metric") => DepthKind::Metric,
        _ => {
            let expected = "an object whose kind is 'inverse' or 'metric'";
            return Err(Error::InvalidArgument { name, expected, value: f64::NAN }.into());
        }
    };
    let data = get(value, "data");
    let length = get(&data, "length").as_f64().unwrap_or(0.0) as usize;
    let invalid = get(value, "invalid").as_f64().map(|v| v as f32);
    let raw: Vec<f32> = if let Some(data) = data.dyn_ref::<Float32Array>() {
        check_len(name, length, width, height, 1)?;
        let mut raw = zeroed(length)?;
        data.copy_to(&mut raw);
        raw
    } else if let Some(data) = data.dyn_ref::<Uint16Array>() {
        check_len(name, length, width, height, 1)?;
        let mut raw: Vec<u16> = zeroed(length)?;
        data.copy_to(&mut raw);
        widen(&raw)?
    } else if let Some(data) = data.dyn_ref::<Uint8Array>() {
        check_len(name, length, width, height, 1)?;
        let mut raw: Vec<u8> = zeroed(length)?;
        data.copy_to(&mut raw);
        widen(&raw)?
    } else {
        let expected = "an object whose data is a Float32Array, Uint16Array or Uint8Array";
        return Err(Error::InvalidArgument { name, expected, value: f64::NAN }.into());
    };
    InverseDepth::new(name, &raw, (width, height), kind, invalid, size).map(Some)
}

fn widen<T: Copy>(raw: &[T]) -> Result<Vec<f32>>
where
    f32: From<T>,
{
    let mut out = Vec::new();
    reserve(&mut out, raw.len())?;
    out.extend(raw.iter().map(|&v| f32::from(v)));
    Ok(out)
}

/// A `Features`.
pub(super) fn features(name: &'static str, value: &JsValue) -> Result<Features> {
    let size = size_from_js(name, value)?;
    let (keypoints, descriptors) = (get(value, "keypoints"), get(value, "descriptors"));
    let (Some(keypoints), Some(descriptors)) =
        (keypoints.dyn_ref::<Float32Array>(), descriptors.dyn_ref::<Uint8Array>())
    else {
        let expected = "an object whose keypoints are a Float32Array and descriptors a Uint8Array";
        return Err(Error::InvalidArgument { name, expected, value: f64::NAN }.into());
    };
    let count = descriptors.length() as usize / 128;
    for (per, actual) in [(128, descriptors.length()), (5, keypoints.length())] {
        let (expected, actual) = (per * count as u64, u64::from(actual));
        if actual != expected {
            return Err(Error::SizeMismatch { name, expected, actual }.into());
        }
    }
    let mut numbers: Vec<f32> = zeroed(5 * count)?;
    keypoints.copy_to(&mut numbers);
    let mut descriptor_bytes: Vec<[u8; 128]> = Vec::new();
    reserve(&mut descriptor_bytes, count)?;
    descriptor_bytes.resize(count, [0; 128]);
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
        let expected = "a Float32Array of xt, yt, xr, yr";
        return Err(Error::InvalidArgument { name, expected, value: f64::NAN }.into());
    };
    let length = array.length();
    if length % 4 != 0 {
        let expected = u64::from(length / 4 * 4);
        return Err(Error::SizeMismatch { name, expected, actual: u64::from(length) }.into());
    }
    let mut flat: Vec<f32> = zeroed(length as usize)?;
    array.copy_to(&mut flat);
    let mut out = Vec::new();
    reserve(&mut out, flat.len() / 4)?;
    out.extend(
        flat.chunks_exact(4).map(|m| Match {
            target: [f64::from(m[0]), f64::from(m[1])],
            reference: [f64::from(m[2]), f64::from(m[3])],
        }),
    );
    Ok(out)
}

/// The matches among the inputs, where there are any.
pub(super) fn optional_matches(inputs: &JsValue) -> Result<Option<Vec<Match>>> {
    Some(get(inputs, "matches")).filter(|given| !given.is_undefined()).map(|given| matches(&given)).transpose()
}

/// A `Model`.
pub(super) fn model(name: &'static str, value: &JsValue) -> Result<Model> {
    let numbers = |key: &str, expected: usize| -> Result<Vec<f64>> {
        let array = get(value, key);
        let Some(array) = array.dyn_ref::<Float64Array>() else {
            let expected = "an object whose h and e are Float64Arrays";
            return Err(Error::InvalidArgument { name, expected, value: f64::NAN }.into());
        };
        if array.length() as usize != expected {
            return Err(
                Error::SizeMismatch { name, expected: expected as u64, actual: u64::from(array.length()) }.into()
            );
        }
        Ok(array.to_vec())
    };
    Ok(Model { h: Matrix3::from_row_slice(&numbers("h", 9)?), e: Vector3::from_column_slice(&numbers("e", 3)?) })
}

/// A `Warped`.
pub(super) fn warped(value: &JsValue) -> Result<Warped> {
    let offset = get(value, "offset");
    let side = |key: &str| {
        let number = get(&offset, key).as_f64().unwrap_or(f64::NAN);
        if number >= 0.0 && number <= f64::from(u32::MAX) && number.floor() == number {
            Ok(number as usize)
        } else {
            let expected = "two whole numbers of at least 0";
            Err(Error::InvalidArgument { name: "offset", expected, value: number })
        }
    };
    Ok(Warped {
        image: image("warped", &get(value, "warped"))?,
        footprint: mask("footprint", &get(value, "footprint"))?,
        depth: None,
        offset: (side("x")?, side("y")?),
        clipped: get(value, "clipped").is_truthy(),
    })
}
