//! JavaScript values to the core's and back, checked before anything is copied.

use js_sys::{Object, Reflect, Uint8Array, Uint8ClampedArray};
use wasm_bindgen::{JsCast, JsValue};

use crate::image::{check_len, zeroed};
use crate::{Error, Result};

/// The JavaScript `Error` for `error`: `message`, and as its own properties `code`, `stage` and `details`.
pub(crate) fn to_js_error(error: &Error, stage: &str) -> JsValue {
    let details = Object::new().into();
    for (name, value) in error.details() {
        put(&details, name, value.into());
    }
    let js = js_sys::Error::new(&error.to_string()).into();
    put(&js, "code", error.code().into());
    put(&js, "stage", stage.into());
    put(&js, "details", details);
    js
}

/// `object[name]`; undefined where there is no such property, or where `object` is no object.
pub(crate) fn get(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &JsValue::from_str(name)).unwrap_or(JsValue::UNDEFINED)
}

/// `object[name] = value`, on an object made here.
pub(crate) fn put(object: &JsValue, name: &str, value: JsValue) {
    // Only a frozen object or a throwing setter can fail, and ours have neither.
    let _ = Reflect::set(object, &JsValue::from_str(name), &value);
}

/// The error for an argument or option that is not what it should be.
pub(crate) fn invalid(name: &'static str, expected: &'static str, given: &JsValue) -> Box<Error> {
    match given.as_f64() {
        Some(value) => Error::InvalidArgument { name, expected, value },
        None => Error::WrongType { name, expected, got: describe(given) },
    }
    .into()
}

/// A value as it appears in a message: strings quoted, objects by their class.
fn describe(value: &JsValue) -> String {
    const LONGEST: usize = 40;
    if let Some(text) = value.as_string() {
        let shown: String = text.chars().take(LONGEST).collect();
        return format!("\"{shown}{}\"", if shown.len() < text.len() { "…" } else { "" });
    }
    if value.is_null() {
        return "null".into();
    }
    let kind = if value.is_object() {
        js_sys::Object::get_prototype_of(value).constructor().name()
    } else {
        value.js_typeof().into()
    };
    kind.as_string().unwrap_or_default()
}

/// Width and height of `{ width, height }`.
///
/// # Errors
/// `invalid-argument` unless both are whole numbers from 1 to 2³²−1.
pub(crate) fn size_from_js(name: &'static str, value: &JsValue) -> Result<(usize, usize)> {
    Ok((
        whole(&get(value, "width"), 1.0, name, "an object whose width is a whole number of at least 1")?,
        whole(&get(value, "height"), 1.0, name, "an object whose height is a whole number of at least 1")?,
    ))
}

/// A whole number from `least` to 2³²−1.
pub(crate) fn whole(value: &JsValue, least: f64, name: &'static str, expected: &'static str) -> Result<usize> {
    let within = |number: &f64| *number >= least && *number <= f64::from(u32::MAX) && number.trunc() == *number;
    match value.as_f64().filter(within) {
        Some(number) => Ok(number as usize),
        None => Err(invalid(name, expected, value)),
    }
}

/// RGBA bytes, width and height of an `ImageInput`.
///
/// # Errors
/// `invalid-argument`, `size-mismatch`, `out-of-memory`.
pub(crate) fn image_from_js(name: &'static str, value: &JsValue) -> Result<(Vec<u8>, usize, usize)> {
    planes_from_js(name, value, 4)
}

/// Bytes, width and height of a `Mask` or another picture of one byte per pixel.
///
/// # Errors
/// `invalid-argument`, `size-mismatch`, `out-of-memory`.
pub(crate) fn mask_from_js(name: &'static str, value: &JsValue) -> Result<(Vec<u8>, usize, usize)> {
    planes_from_js(name, value, 1)
}

fn planes_from_js(name: &'static str, value: &JsValue, channels: u64) -> Result<(Vec<u8>, usize, usize)> {
    let (width, height) = size_from_js(name, value)?;
    let expected = "an object whose data is a Uint8Array or Uint8ClampedArray";
    let data = get(value, "data");
    let view = byte_view(&data).ok_or_else(|| invalid(name, expected, &data))?;
    check_len(name, view.length() as usize, width, height, channels)?;
    Ok((copy(&view)?, width, height))
}

/// The bytes of a `Uint8Array` or `Uint8ClampedArray`.
///
/// # Errors
/// `invalid-argument` for anything else, `out-of-memory`.
#[cfg(feature = "wasm-codecs")]
pub(crate) fn bytes_from_js(name: &'static str, value: &JsValue) -> Result<Vec<u8>> {
    copy(&byte_view(value).ok_or_else(|| invalid(name, "a Uint8Array", value))?)
}

/// `{ data: Uint8ClampedArray, width, height }`, owned by JavaScript.
#[cfg(any(feature = "wasm-core", feature = "wasm-codecs"))]
pub(crate) fn image_to_js(data: &[u8], width: usize, height: usize) -> JsValue {
    sized(Uint8ClampedArray::from(data).into(), width, height)
}

/// `{ data, width, height }`.
#[cfg(any(feature = "wasm-core", feature = "wasm-codecs"))]
pub(crate) fn sized(data: JsValue, width: usize, height: usize) -> JsValue {
    let object = Object::new().into();
    put(&object, "data", data);
    put(&object, "width", (width as f64).into());
    put(&object, "height", (height as f64).into());
    object
}

fn byte_view(value: &JsValue) -> Option<Uint8Array> {
    if let Some(bytes) = value.dyn_ref::<Uint8Array>() {
        return Some(bytes.clone());
    }
    let clamped = value.dyn_ref::<Uint8ClampedArray>()?;
    Some(Uint8Array::new_with_byte_offset_and_length(&clamped.buffer(), clamped.byte_offset(), clamped.length()))
}

fn copy(view: &Uint8Array) -> Result<Vec<u8>> {
    let mut bytes = zeroed(view.length() as usize)?;
    view.copy_to(&mut bytes);
    Ok(bytes)
}
