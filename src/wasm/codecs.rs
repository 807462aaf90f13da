//! The exports of the codecs module. Every error is of stage `input`.

use js_sys::{Object, Uint8Array, Uint16Array};
use wasm_bindgen::prelude::*;

use super::convert::{
    bytes_from_js, image_from_js, image_to_js, invalid, mask_from_js, put, size_from_js, sized, to_js_error,
};
use crate::codecs::{self, Metadata, Samples};
use crate::{Image, ImageView, Result, Stage};

/// Decodes a PNG or JPEG, turned upright by its EXIF orientation.
#[wasm_bindgen(js_name = decodeImage, unchecked_return_type = "ImageOutput")]
pub fn decode_image(
    #[wasm_bindgen(unchecked_param_type = "Uint8Array")] bytes: &JsValue,
    #[wasm_bindgen(js_name = maxPixels, unchecked_param_type = "number")] max_pixels: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let image = codecs::decode_image(&bytes_from_js("bytes", bytes)?, pixel_limit(max_pixels)?)?;
        Ok(image_to_js(image.data(), image.width(), image.height()))
    })
}

/// Decodes a depth map: one channel, 8 or 16 bit as in the file; colour becomes luma.
#[wasm_bindgen(
    js_name = decodeDepth,
    unchecked_return_type = "{ data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer>; width: number; height: number }"
)]
pub fn decode_depth(
    #[wasm_bindgen(unchecked_param_type = "Uint8Array")] bytes: &JsValue,
    #[wasm_bindgen(js_name = maxPixels, unchecked_param_type = "number")] max_pixels: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let gray = codecs::decode_depth(&bytes_from_js("bytes", bytes)?, pixel_limit(max_pixels)?)?;
        let data: JsValue = match &gray.samples {
            Samples::Eight(data) => Uint8Array::from(data.as_slice()).into(),
            Samples::Sixteen(data) => Uint16Array::from(data.as_slice()).into(),
        };
        Ok(sized(data, gray.width, gray.height))
    })
}

/// Colour profile and EXIF data of a PNG or JPEG; null where there is none.
#[wasm_bindgen(
    js_name = readMetadata,
    unchecked_return_type = "{ colourProfile: Uint8Array<ArrayBuffer> | null; exif: Uint8Array<ArrayBuffer> | null }"
)]
pub fn read_metadata(
    #[wasm_bindgen(unchecked_param_type = "Uint8Array")] bytes: &JsValue,
    #[wasm_bindgen(js_name = maxPixels, unchecked_param_type = "number")] max_pixels: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let found = codecs::read_metadata(&bytes_from_js("bytes", bytes)?, pixel_limit(max_pixels)?)?;
        let result = JsValue::from(Object::new());
        for (name, data) in [("colourProfile", found.colour_profile), ("exif", found.exif)] {
            put(&result, name, data.map_or(JsValue::NULL, |data| Uint8Array::from(data.as_slice()).into()));
        }
        Ok(result)
    })
}

/// The focal length in pixels that EXIF data tell of a photo that has this size now; null where they do not.
#[wasm_bindgen(js_name = readFocalLength, unchecked_return_type = "number | null")]
pub fn read_focal_length(
    #[wasm_bindgen(unchecked_param_type = "Uint8Array")] exif: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "{ readonly width: number; readonly height: number }")] size: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let exif = bytes_from_js("exif", exif)?;
        Ok(codecs::focal_length(&exif, size_from_js("size", size)?).map_or(JsValue::NULL, JsValue::from))
    })
}

/// Converts a picture from the colours of one ICC profile to those of another; null is sRGB.
#[wasm_bindgen(js_name = convertColours, unchecked_return_type = "ImageOutput")]
pub fn convert_colours(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] image: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Uint8Array | null")] from: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Uint8Array | null")] to: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let (data, width, height) = image_from_js("image", image)?;
        let mut image = Image::new(data, width, height)?;
        let (from, to) = (optional_bytes("from", from)?, optional_bytes("to", to)?);
        codecs::convert_colours(&mut image, from.as_deref(), to.as_deref())?;
        Ok(image_to_js(image.data(), width, height))
    })
}

/// Encodes a picture as PNG, alpha kept, with an ICC profile and EXIF data unless they are null.
#[wasm_bindgen(js_name = encodePng, unchecked_return_type = "Uint8Array<ArrayBuffer>")]
pub fn encode_png(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] image: &JsValue,
    #[wasm_bindgen(js_name = colourProfile, unchecked_param_type = "Uint8Array | null")] colour_profile: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Uint8Array | null")] exif: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let (data, width, height) = image_from_js("image", image)?;
        let png = codecs::encode_png(ImageView::new("image", &data, width, height)?, &metadata(colour_profile, exif)?)?;
        Ok(Uint8Array::from(png.as_slice()).into())
    })
}

/// Encodes a mask, or another picture of one byte per pixel, as a gray PNG.
#[wasm_bindgen(js_name = encodeGrayPng, unchecked_return_type = "Uint8Array<ArrayBuffer>")]
pub fn encode_gray_png(
    #[wasm_bindgen(
        unchecked_param_type = "{ readonly data: Uint8Array | Uint8ClampedArray; readonly width: number; readonly height: number }"
    )]
    mask: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let (data, width, height) = mask_from_js("mask", mask)?;
        Ok(Uint8Array::from(codecs::encode_gray_png(&data, width, height)?.as_slice()).into())
    })
}

/// Encodes a picture as JPEG of quality 1 to 100, laid over black where it is transparent, with an ICC profile and EXIF data unless
/// they are null.
#[wasm_bindgen(js_name = encodeJpeg, unchecked_return_type = "Uint8Array<ArrayBuffer>")]
pub fn encode_jpeg(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] image: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "number")] quality: &JsValue,
    #[wasm_bindgen(js_name = colourProfile, unchecked_param_type = "Uint8Array | null")] colour_profile: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "Uint8Array | null")] exif: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let value = quality.as_f64().unwrap_or(f64::NAN);
        if !(1.0..=100.0).contains(&value) || value.trunc() != value {
            return Err(invalid("quality", "a whole number from 1 to 100", quality));
        }
        let (data, width, height) = image_from_js("image", image)?;
        let picture = ImageView::new("image", &data, width, height)?;
        let jpeg = codecs::encode_jpeg(picture, value as u8, &metadata(colour_profile, exif)?)?;
        Ok(Uint8Array::from(jpeg.as_slice()).into())
    })
}

fn metadata(colour_profile: &JsValue, exif: &JsValue) -> Result<Metadata> {
    let colour_profile = optional_bytes("colourProfile", colour_profile)?;
    Ok(Metadata { colour_profile, exif: optional_bytes("exif", exif)? })
}

fn optional_bytes(name: &'static str, value: &JsValue) -> Result<Option<Vec<u8>>> {
    if value.is_null() || value.is_undefined() { Ok(None) } else { bytes_from_js(name, value).map(Some) }
}

fn raise(work: impl FnOnce() -> Result<JsValue>) -> std::result::Result<JsValue, JsValue> {
    work().map_err(|error| to_js_error(&error, Stage::Input.name()))
}

/// Infinity is a limit too: none.
fn pixel_limit(value: &JsValue) -> Result<u64> {
    match value.as_f64().filter(|pixels| *pixels >= 1.0) {
        Some(pixels) => Ok(pixels as u64),
        None => Err(invalid("maxPixels", "a number of at least 1", value)),
    }
}
