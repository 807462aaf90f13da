//! Features and matches from JavaScript.

use js_sys::{Float32Array, Uint8Array};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, invalid, size_from_js};
use super::inputs::{check_length, floats, is_given};
use crate::Result;
use crate::features::{DESCRIPTOR_LENGTH, Features, Keypoint};
use crate::geometry::Match;
use crate::image::{reserve, zeroed};

/// A `Features`.
pub(super) fn features(name: &'static str, value: &JsValue) -> Result<Features> {
    let size = size_from_js(name, value)?;
    let (keypoints, descriptors) = (get(value, "keypoints"), get(value, "descriptors"));
    let (Some(keypoints), Some(descriptors)) =
        (keypoints.dyn_ref::<Float32Array>(), descriptors.dyn_ref::<Uint8Array>())
    else {
        return Err(invalid(name, "an object whose keypoints are a Float32Array and descriptors a Uint8Array", value));
    };
    let count = descriptors.length() as usize / DESCRIPTOR_LENGTH;
    check_length(name, descriptors.length(), DESCRIPTOR_LENGTH * count)?;
    check_length(name, keypoints.length(), 5 * count)?;
    let numbers = floats(keypoints)?;
    let mut descriptor_bytes: Vec<[u8; DESCRIPTOR_LENGTH]> = zeroed(count)?;
    descriptors.copy_to(descriptor_bytes.as_flattened_mut());
    let keypoint = |&[x, y, scale, angle, response]: &[f32; 5]| Keypoint { x, y, scale, angle, response };
    Ok(Features {
        keypoints: numbers.as_chunks().0.iter().map(keypoint).collect(),
        descriptors: descriptor_bytes,
        size,
    })
}

/// Matches from a `Float32Array` of xt, yt, xr, yr.
pub(super) fn required(value: &JsValue) -> Result<Vec<Match>> {
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
pub(super) fn optional(inputs: &JsValue) -> Result<Option<Vec<Match>>> {
    Some(get(inputs, "matches")).filter(is_given).map(|given| required(&given)).transpose()
}
