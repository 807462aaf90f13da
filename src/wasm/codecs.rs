//! The exports of the codecs module. Every error is of stage `input`.

use js_sys::{Uint8Array, Uint16Array};
use wasm_bindgen::prelude::*;

use super::convert::{bytes_from_js, image_from_js, image_to_js, invalid, mask_from_js, sized, to_js_error};
use crate::codecs::{self, Samples};
use crate::{ImageView, Result, Stage};

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

/// Encodes a picture as PNG, alpha kept.
#[wasm_bindgen(js_name = encodePng, unchecked_return_type = "Uint8Array<ArrayBuffer>")]
pub fn encode_png(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] image: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let (data, width, height) = image_from_js("image", image)?;
        let png = codecs::encode_png(ImageView::new("image", &data, width, height)?)?;
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

/// Encodes a picture as JPEG of quality 1 to 100, laid over black where it is transparent.
#[wasm_bindgen(js_name = encodeJpeg, unchecked_return_type = "Uint8Array<ArrayBuffer>")]
pub fn encode_jpeg(
    #[wasm_bindgen(unchecked_param_type = "ImageInput")] image: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "number")] quality: &JsValue,
) -> std::result::Result<JsValue, JsValue> {
    raise(|| {
        let value = quality.as_f64().unwrap_or(f64::NAN);
        if !(1.0..=100.0).contains(&value) || value.trunc() != value {
            return Err(invalid("quality", "a whole number from 1 to 100", quality));
        }
        let (data, width, height) = image_from_js("image", image)?;
        let jpeg = codecs::encode_jpeg(ImageView::new("image", &data, width, height)?, value as u8)?;
        Ok(Uint8Array::from(jpeg.as_slice()).into())
    })
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
