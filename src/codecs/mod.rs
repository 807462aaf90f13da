//! PNG and JPEG files to images and back, where the platform's own codecs will not do: 16-bit depth maps, and Node.
//!
//! Sizes are read from the header and checked before any pixel is decoded.

mod colour;
mod exif;
mod metadata;

use std::io::Cursor;

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::metadata::Orientation;
use image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, Limits};

use crate::image::{check_len, reserve, zeroed};
use crate::luma::rec709;
use crate::{Error, Image, ImageView, Result};
pub use colour::convert_colours;
pub use exif::focal_length;
use metadata::attach;
pub use metadata::{Metadata, read_metadata};

/// Bytes that may always be taken for colour profiles and texts of a file.
const MOST_METADATA: u64 = 1 << 24;

/// One channel, in the bit depth of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// 8 bit.
    Eight(Vec<u8>),
    /// 16 bit.
    Sixteen(Vec<u16>),
}

/// A picture of one channel, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gray {
    /// width·height values.
    pub samples: Samples,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
}

/// Decodes a PNG or JPEG to RGBA, 8 bit, turned upright by its EXIF orientation. Colours stay as they are in the file:
/// its colour profile is not applied, but [`read_metadata`] has it.
///
/// # Errors
/// `too-large` above `max_pixels`, `decode-failed` for another format or a damaged file, `out-of-memory`.
pub fn decode_image(bytes: &[u8], max_pixels: u64) -> Result<Image> {
    let raw = Raw::decode(bytes, max_pixels, 4)?;
    let (width, height) = raw.upright_size();
    let mut data = Vec::new();
    reserve(&mut data, width.saturating_mul(height).saturating_mul(4))?;
    for i in raw.upright_indices() {
        data.extend(raw.rgba(i).map(to_eight));
    }
    Ok(Image::from_bytes(data, width, height))
}

/// Decodes a PNG or JPEG to one channel, turned upright by its EXIF orientation. 8 bit stay 8, 16 bit stay 16. Colour
/// becomes luma (Rec. 709 weights on the values as stored, so that equal channels keep their value); alpha is ignored.
///
/// # Errors
/// As [`decode_image`].
pub fn decode_depth(bytes: &[u8], max_pixels: u64) -> Result<Gray> {
    let raw = Raw::decode(bytes, max_pixels, 2)?;
    let (width, height) = raw.upright_size();
    let samples = if raw.sixteen() {
        let mut data = Vec::new();
        reserve(&mut data, width * height)?;
        data.extend(raw.upright_indices().map(|i| rec709(raw.rgba(i))));
        Samples::Sixteen(data)
    } else {
        let mut data = Vec::new();
        reserve(&mut data, width * height)?;
        data.extend(raw.upright_indices().map(|i| to_eight(rec709(raw.rgba(i)))));
        Samples::Eight(data)
    };
    Ok(Gray { samples, width, height })
}

/// Encodes RGBA as PNG, alpha kept, with its colour profile and the EXIF data of the photo that it was made of.
///
/// # Errors
/// `invalid-argument` for a side that PNG cannot state.
pub fn encode_png(picture: ImageView<'_>, metadata: &Metadata) -> Result<Vec<u8>> {
    write_png(picture.data(), picture.size(), ExtendedColorType::Rgba8, metadata)
}

/// Encodes one byte per pixel, a mask for instance, as a gray PNG.
///
/// # Errors
/// `invalid-argument` for a side that is empty or that PNG cannot state, `size-mismatch`.
pub fn encode_gray_png(data: &[u8], width: usize, height: usize) -> Result<Vec<u8>> {
    check_len("mask", data.len(), width, height, 1)?;
    write_png(data, (width, height), ExtendedColorType::L8, &Metadata::default())
}

/// Encodes as JPEG of `quality` 1 to 100, with its colour profile and the EXIF data of the photo that it was made of. JPEG has no
/// alpha: the picture is laid over black.
///
/// # Errors
/// `invalid-argument` for a quality outside its range or a side above 65535, `out-of-memory`.
pub fn encode_jpeg(picture: ImageView<'_>, quality: u8, metadata: &Metadata) -> Result<Vec<u8>> {
    if !(1..=100).contains(&quality) {
        let value = f64::from(quality);
        return Err(Error::InvalidArgument { name: "quality", expected: "a whole number from 1 to 100", value }.into());
    }
    let expected = "at most 65535 pixels wide and high as JPEG";
    let width = side(picture.width(), u16::MAX.into(), expected)?;
    let height = side(picture.height(), u16::MAX.into(), expected)?;
    let mut rgb = Vec::new();
    reserve(&mut rgb, 3 * picture.width() * picture.height())?;
    for pixel in picture.data().chunks_exact(4) {
        let alpha = u32::from(pixel[3]);
        rgb.extend(pixel[..3].iter().map(|&v| ((u32::from(v) * alpha + 127) / 255) as u8));
    }
    let mut out = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut out, quality);
    attach(&mut encoder, metadata, (width, height));
    encoder
        .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(|_| Error::OutOfMemory { bytes: rgb.len() as u64 })?;
    Ok(out)
}

fn write_png(
    data: &[u8],
    (width, height): (usize, usize),
    color: ExtendedColorType,
    metadata: &Metadata,
) -> Result<Vec<u8>> {
    let expected = "at most 2147483647 pixels wide and high as PNG";
    let (w, h) = (side(width, i32::MAX as u32, expected)?, side(height, i32::MAX as u32, expected)?);
    let mut out = Vec::new();
    // Into a Vec, writing fails only where there is no more memory.
    let mut encoder = PngEncoder::new_with_quality(&mut out, CompressionType::Default, FilterType::Adaptive);
    attach(&mut encoder, metadata, (w, h));
    encoder.write_image(data, w, h, color).map_err(|_| Error::OutOfMemory { bytes: data.len() as u64 })?;
    Ok(out)
}

fn side(value: usize, most: u32, expected: &'static str) -> Result<u32> {
    match u32::try_from(value) {
        Ok(v) if v <= most => Ok(v),
        _ => Err(Error::InvalidArgument { name: "image", expected, value: value as f64 }.into()),
    }
}

/// The decoder of a file that is not too large, as far as that can be told; `bytes_per_pixel` is that of the result, for the prediction
/// in `too-large`.
fn decoder(bytes: &[u8], max_pixels: u64, bytes_per_pixel: u64) -> Result<Box<dyn ImageDecoder + '_>> {
    let failed = |reason: String| Box::new(Error::DecodeFailed { bytes: bytes.len() as u64, reason });
    let broken = |error: ImageError| failed(error.to_string());
    let predict = |(w, h): (u32, u32)| (u64::from(w) * u64::from(h)).saturating_mul(bytes_per_pixel);
    let check_size = |(width, height): (u32, u32)| {
        if u64::from(width) * u64::from(height) <= max_pixels {
            return Ok(());
        }
        let limit = max_pixels.saturating_mul(bytes_per_pixel);
        Err(Error::TooLarge { width: width.into(), height: height.into(), bytes: predict((width, height)), limit })
    };
    let decoder: Box<dyn ImageDecoder + '_> = if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        // The decoder's constructor already takes memory for a row.
        let size = png_size(bytes).ok_or_else(|| failed("the PNG file ends in its header".into()))?;
        check_size(size)?;
        // Bounds rows, and what is inflated on the way to the pixels, as a colour profile: a small file can claim a huge one.
        let mut limits = Limits::no_limits();
        let pixels = u64::from(size.0).saturating_mul(size.1.into());
        limits.max_alloc = Some((bytes.len() as u64).saturating_add(pixels.saturating_mul(8)).max(MOST_METADATA));
        let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(|error| match error {
            ImageError::Limits(_) => Error::OutOfMemory { bytes: predict(size) }.into(),
            other => broken(other),
        })?;
        Box::new(decoder)
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        Box::new(JpegDecoder::new(Cursor::new(bytes)).map_err(broken)?)
    } else {
        return Err(failed("neither a PNG nor a JPEG file".into()));
    };
    let (width, height) = decoder.dimensions();
    check_size((width, height))?;
    if bytes.starts_with(b"\xff\xd8") {
        // Of what is missing the decoder silently makes gray, at length: each block of 8×8 pixels takes a bit at least.
        let blocks = u64::from(width.div_ceil(8)) * u64::from(height.div_ceil(8));
        if 8 * (bytes.len() as u64) < blocks || !jpeg_is_complete(bytes) {
            return Err(failed("the JPEG file ends before its picture does".into()));
        }
    }
    Ok(decoder)
}

/// A decoded file as it is stored: any colour type, not yet turned upright.
struct Raw {
    data: Vec<u8>,
    color: ColorType,
    width: usize,
    height: usize,
    orientation: Orientation,
}

impl Raw {
    /// `bytes_per_pixel` is that of the result.
    fn decode(bytes: &[u8], max_pixels: u64, bytes_per_pixel: u64) -> Result<Self> {
        let broken = |error: ImageError| Error::DecodeFailed { bytes: bytes.len() as u64, reason: error.to_string() };
        let mut decoder = decoder(bytes, max_pixels, bytes_per_pixel)?;
        let (width, height) = decoder.dimensions();
        let orientation = decoder.orientation().map_err(broken)?;
        let color = decoder.color_type();
        let total = decoder.total_bytes();
        let mut data = zeroed(usize::try_from(total).map_err(|_| Error::OutOfMemory { bytes: total })?)?;
        decoder.read_image_boxed(&mut data).map_err(broken)?;
        Ok(Self { data, color, width: width as usize, height: height as usize, orientation })
    }

    fn sixteen(&self) -> bool {
        matches!(self.color, ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16)
    }

    /// The `i`-th stored pixel, 16 bit (8-bit values times 257).
    fn rgba(&self, i: usize) -> [u16; 4] {
        let channels = usize::from(self.color.channel_count());
        let at = |channel: usize| {
            let k = i * channels + channel;
            if self.sixteen() {
                u16::from_ne_bytes([self.data[2 * k], self.data[2 * k + 1]])
            } else {
                u16::from(self.data[k]) * 257
            }
        };
        match channels {
            1 => [at(0), at(0), at(0), u16::MAX],
            2 => [at(0), at(0), at(0), at(1)],
            3 => [at(0), at(1), at(2), u16::MAX],
            _ => [at(0), at(1), at(2), at(3)],
        }
    }

    fn upright_size(&self) -> (usize, usize) {
        use Orientation::*;
        match self.orientation {
            Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH => (self.height, self.width),
            NoTransforms | Rotate180 | FlipHorizontal | FlipVertical => (self.width, self.height),
        }
    }

    /// Stored index of each pixel of the upright picture, row by row.
    fn upright_indices(&self) -> impl Iterator<Item = usize> + '_ {
        use Orientation::*;
        let (width, height) = self.upright_size();
        let (right, bottom) = (self.width - 1, self.height - 1);
        (0..height).flat_map(move |y| {
            (0..width).map(move |x| {
                let (stored_x, stored_y) = match self.orientation {
                    NoTransforms => (x, y),
                    FlipHorizontal => (right - x, y),
                    Rotate180 => (right - x, bottom - y),
                    FlipVertical => (x, bottom - y),
                    Rotate90FlipH => (y, x),
                    Rotate90 => (y, bottom - x),
                    Rotate270FlipH => (right - y, bottom - x),
                    Rotate270 => (right - y, x),
                };
                stored_y * self.width + stored_x
            })
        })
    }
}

fn to_eight(value: u16) -> u8 {
    ((u32::from(value) + 128) / 257) as u8
}

/// Width and height in the header of a PNG.
fn png_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let &[a, b, c, d, e, f, g, h] = bytes.get(16..24)? else { return None };
    Some((u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h])))
}

/// Whether the marker segments and scans of a JPEG lead to its end-of-image marker (ITU T.81, annex B).
fn jpeg_is_complete(bytes: &[u8]) -> bool {
    const END: u8 = 0xd9;
    let mut rest = bytes.get(2..).unwrap_or_default();
    loop {
        // Between segments only fill bytes are legal; after a scan its coded data is skipped: there 0xff is followed
        // by 0 (a data byte) or by a restart marker, which do not end it.
        let next = rest.windows(2).position(|w| w[0] == 0xff && !matches!(w[1], 0 | 0xff | 0xd0..=0xd7));
        let Some(at) = next else { return false };
        let marker = rest[at + 1];
        if marker == END {
            return true;
        }
        let Some(&[high, low]) = rest.get(at + 2..at + 4) else { return false };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let Some(after) = rest.get(at + 2 + length..) else { return false };
        rest = after;
    }
}
