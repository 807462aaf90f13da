//! Files in and out: what comes back, and how damaged or oversized files are refused.
#![cfg(feature = "codecs")]
#![allow(clippy::unwrap_used, clippy::panic)]

use depthstitch::codecs::{self, Metadata, Samples, decode_depth, decode_image, encode_gray_png};
use depthstitch::{Error, Image, ImageView, Result};
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const NO_LIMIT: u64 = u64::MAX;

/// Every pixel different, every alpha too.
fn picture(width: usize, height: usize) -> Image {
    let data = (0..width * height)
        .flat_map(|i| {
            let (x, y) = (i % width, i / width);
            [(x * 255 / width) as u8, (y * 255 / height) as u8, (i * 7) as u8, (i * 13 + 5) as u8]
        })
        .collect();
    Image::new(data, width, height).unwrap()
}

fn png(data: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
    let mut out = Vec::new();
    PngEncoder::new(&mut out).write_image(data, width, height, color).unwrap();
    out
}

fn gray_jpeg(data: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut out = Vec::new();
    JpegEncoder::new_with_quality(&mut out, 100).write_image(data, width, height, ExtendedColorType::L8).unwrap();
    out
}

fn encode_png(picture: ImageView<'_>) -> Result<Vec<u8>> {
    codecs::encode_png(picture, &Metadata::default())
}

fn encode_jpeg(picture: ImageView<'_>, quality: u8) -> Result<Vec<u8>> {
    codecs::encode_jpeg(picture, quality, &Metadata::default())
}

/// The JPEG with an EXIF segment that states `orientation`, in either byte order.
fn with_orientation(jpeg: &[u8], orientation: u16, big_endian: bool) -> Vec<u8> {
    let short = |v: u16| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let long = |v: u32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
    let mut exif = b"Exif\0\0".to_vec();
    exif.extend(if big_endian { b"MM" } else { b"II" });
    exif.extend(short(42));
    exif.extend(long(8));
    exif.extend(short(1));
    exif.extend([short(0x0112), short(3)].concat());
    exif.extend(long(1));
    exif.extend([short(orientation), short(0)].concat());
    exif.extend(long(0));
    let length = (exif.len() as u16 + 2).to_be_bytes();
    [&jpeg[..2], &[0xff, 0xe1], &length, &exif, &jpeg[2..]].concat()
}

fn decode_failure(result: Result<impl std::fmt::Debug>, bytes: &[u8]) -> String {
    match result.map_err(|error| *error) {
        Err(Error::DecodeFailed { bytes: n, reason }) if n == bytes.len() as u64 => reason,
        other => panic!("expected decode-failed, got {other:?}"),
    }
}

#[test]
fn png_returns_every_byte_alpha_included() {
    for (width, height) in [(1, 1), (3, 2), (67, 41)] {
        let image = picture(width, height);
        assert_eq!(decode_image(&encode_png(image.view()).unwrap(), NO_LIMIT).unwrap(), image);
    }
}

#[test]
fn gray_png_returns_every_byte() {
    let mask: Vec<u8> = (0..23 * 17).map(|i| (i * 11) as u8).collect();
    let gray = decode_depth(&encode_gray_png(&mask, 23, 17).unwrap(), NO_LIMIT).unwrap();
    assert_eq!((gray.width, gray.height, gray.samples), (23, 17, Samples::Eight(mask.clone())));
    assert_eq!(
        encode_gray_png(&mask, 23, 18),
        Err(Error::SizeMismatch { name: "mask", expected: 23 * 18, actual: 23 * 17 }.into())
    );
}

#[test]
fn depth_keeps_sixteen_bits() {
    let values: Vec<u16> = (0..31 * 9).map(|i| (i * 233) as u16).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    let gray = decode_depth(&png(&bytes, 31, 9, ExtendedColorType::L16), NO_LIMIT).unwrap();
    assert_eq!((gray.width, gray.height, gray.samples), (31, 9, Samples::Sixteen(values)));
}

#[test]
fn colour_depth_becomes_luma() {
    // Equal channels keep their value; green weighs most.
    let rgb: Vec<u8> = (0..=255).flat_map(|v| [v, v, v]).chain([255, 0, 0, 0, 255, 0, 0, 0, 255]).collect();
    let gray = decode_depth(&png(&rgb, 259, 1, ExtendedColorType::Rgb8), NO_LIMIT).unwrap();
    let expected: Vec<u8> = (0..=255).chain([54, 182, 18]).collect();
    assert_eq!(gray.samples, Samples::Eight(expected));

    let rgba16: Vec<u8> = [1000u16, 1000, 1000, 7].iter().flat_map(|v| v.to_ne_bytes()).collect();
    let gray = decode_depth(&png(&rgba16, 1, 1, ExtendedColorType::Rgba16), NO_LIMIT).unwrap();
    assert_eq!(gray.samples, Samples::Sixteen(vec![1000]));
}

#[test]
fn sixteen_bit_and_gray_files_decode_as_pictures() {
    let la16: Vec<u8> = [0x1234u16, 0xffff].iter().flat_map(|v| v.to_ne_bytes()).collect();
    let image = decode_image(&png(&la16, 1, 1, ExtendedColorType::La16), NO_LIMIT).unwrap();
    assert_eq!(image.data(), [0x12, 0x12, 0x12, 255]);
    let image = decode_image(&png(&[9, 200], 2, 1, ExtendedColorType::L8), NO_LIMIT).unwrap();
    assert_eq!(image.data(), [9, 9, 9, 255, 200, 200, 200, 255]);
}

#[test]
fn jpeg_comes_back_close_and_opaque() {
    let mut image = picture(64, 48);
    for (i, pixel) in image.data_mut().chunks_exact_mut(4).enumerate() {
        pixel[2] = (i % 64) as u8;
        pixel[3] = 255;
    }
    let back = decode_image(&encode_jpeg(image.view(), 95).unwrap(), NO_LIMIT).unwrap();
    assert_eq!(back.size(), (64, 48));
    let worst = image.data().iter().zip(back.data()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst <= 12, "worst difference {worst}");
    assert!(back.data().chunks_exact(4).all(|p| p[3] == 255));
    // A lower quality is a smaller file.
    assert!(encode_jpeg(image.view(), 30).unwrap().len() < encode_jpeg(image.view(), 95).unwrap().len());
}

#[test]
fn jpeg_lays_transparent_pixels_over_black() {
    let image = Image::new([255, 255, 255, 0].repeat(256), 16, 16).unwrap();
    let back = decode_image(&encode_jpeg(image.view(), 90).unwrap(), NO_LIMIT).unwrap();
    assert!(back.data().chunks_exact(4).all(|p| p[..3].iter().all(|&v| v <= 2)), "{:?}", &back.data()[..4]);
}

#[test]
fn jpeg_refuses_what_it_cannot_state() {
    let image = picture(8, 8);
    for quality in [0, 101] {
        let error = encode_jpeg(image.view(), quality).unwrap_err();
        assert_eq!((error.code(), error.details()), ("invalid-argument", vec![("value", f64::from(quality))]));
    }
    let wide = Image::new(vec![0; 4 * 65536], 65536, 1).unwrap();
    assert_eq!(encode_jpeg(wide.view(), 90).unwrap_err().details(), [("value", 65536.0)]);
}

#[test]
fn exif_orientation_turns_pictures_upright() {
    // Four quarters with their own gray, on a 32×16 picture: blocks of 8 keep them apart in the JPEG.
    let quarter = |x: usize, y: usize| [20, 90, 160, 230][usize::from(y >= 8) * 2 + usize::from(x >= 16)];
    let data: Vec<u8> = (0..32 * 16).map(|i| quarter(i % 32, i / 32)).collect();
    let jpeg = gray_jpeg(&data, 32, 16);
    // Top left, top right, bottom left, bottom right of the upright picture, from the EXIF standard's table.
    let expected = [
        (1, [20, 90, 160, 230]),
        (2, [90, 20, 230, 160]),
        (3, [230, 160, 90, 20]),
        (4, [160, 230, 20, 90]),
        (5, [20, 160, 90, 230]),
        (6, [160, 20, 230, 90]),
        (7, [230, 90, 160, 20]),
        (8, [90, 230, 20, 160]),
    ];
    for (orientation, corners) in expected {
        let file = with_orientation(&jpeg, orientation, orientation % 2 == 0);
        let image = decode_image(&file, NO_LIMIT).unwrap();
        let size = if orientation < 5 { (32, 16) } else { (16, 32) };
        assert_eq!(image.size(), size, "orientation {orientation}");
        let depth = decode_depth(&file, NO_LIMIT).unwrap();
        let Samples::Eight(depth) = depth.samples else { panic!("8 bit stay 8 bit") };
        let (right, bottom) = (size.0 - 1, size.1 - 1);
        for ((x, y), corner) in [(0, 0), (right, 0), (0, bottom), (right, bottom)].into_iter().zip(corners) {
            let value = image.view().pixel(x, y)[0];
            assert!(value.abs_diff(corner) <= 3, "orientation {orientation}: {value} at {x}, {y} instead of {corner}");
            assert_eq!(depth[y * size.0 + x], value, "orientation {orientation}");
        }
    }
    // An orientation that does not exist is none.
    let image = decode_image(&with_orientation(&jpeg, 9, false), NO_LIMIT).unwrap();
    assert_eq!(image.size(), (32, 16));
}

#[test]
fn truncated_files_are_refused() {
    let image = picture(96, 64);
    for file in [encode_png(image.view()).unwrap(), encode_jpeg(image.view(), 90).unwrap()] {
        for keep in [4, 20, 60, file.len() / 2, file.len() - 40] {
            decode_failure(decode_image(&file[..keep], NO_LIMIT), &file[..keep]);
            decode_failure(decode_depth(&file[..keep], NO_LIMIT), &file[..keep]);
        }
    }
    // Only the end-of-image marker is missing.
    let file = encode_jpeg(image.view(), 90).unwrap();
    let cut = &file[..file.len() - 2];
    assert!(decode_failure(decode_image(cut, NO_LIMIT), cut).contains("ends before"));
    // Something after it does no harm: some phones append a film.
    assert!(decode_image(&[&file[..], b"appended"].concat(), NO_LIMIT).is_ok());
}

#[test]
fn damaged_png_is_refused() {
    let mut file = encode_png(picture(96, 64).view()).unwrap();
    let middle = file.len() / 2;
    file[middle] ^= 0x55;
    decode_failure(decode_image(&file, NO_LIMIT), &file);
}

#[test]
fn what_is_no_picture_is_refused() {
    for bytes in [&b""[..], b"GIF89a", b"<svg/>", &[0xff, 0xd8], &[0xff, 0xd8, 0xff], b"\x89PNG\r\n\x1a\n", &[0; 5000]]
    {
        decode_failure(decode_image(bytes, NO_LIMIT), bytes);
        decode_failure(decode_depth(bytes, NO_LIMIT), bytes);
    }
}

#[test]
fn any_damaged_byte_gives_an_error_or_a_picture_never_a_panic() {
    let image = picture(24, 16);
    for file in [encode_png(image.view()).unwrap(), encode_jpeg(image.view(), 80).unwrap()] {
        for i in 0..file.len().min(1200) {
            for bit in [0x01, 0x80] {
                let mut bytes = file.clone();
                bytes[i] ^= bit;
                match decode_image(&bytes, 1 << 20) {
                    Ok(image) => assert_eq!(image.data().len(), 4 * image.width() * image.height()),
                    Err(error) => assert!(["decode-failed", "too-large"].contains(&error.code()), "{error}"),
                }
            }
        }
    }
}

#[test]
fn huge_declared_size_is_refused_before_it_is_allocated() {
    // In less than 100 bytes: were any of it allocated, this would not return.
    let declared = |width: u32, height: u32| {
        let mut file = png(&[0; 4], 2, 2, ExtendedColorType::L8);
        file[16..20].copy_from_slice(&width.to_be_bytes());
        file[20..24].copy_from_slice(&height.to_be_bytes());
        let crc = crc32(&file[12..29]);
        file[29..33].copy_from_slice(&crc.to_be_bytes());
        file
    };
    let side = 1u64 << 30;
    let error = decode_image(&declared(1 << 30, 1 << 30), 1 << 26).unwrap_err();
    assert_eq!(*error, Error::TooLarge { width: side, height: side, bytes: 4 << 60, limit: 4 << 26 });
    assert_eq!(decode_depth(&declared(1 << 30, 1 << 30), 1 << 26).unwrap_err().code(), "too-large");
    // Without a limit the allocator is asked, and refuses.
    assert_eq!(decode_image(&declared(1 << 20, 1 << 30), NO_LIMIT).unwrap_err().code(), "out-of-memory");

    let mut file = gray_jpeg(&[0; 64], 8, 8);
    let frame = file.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    file[frame + 5..frame + 9].copy_from_slice(&[0xff; 4]);
    let error = decode_image(&file, 1 << 26).unwrap_err();
    assert_eq!(*error, Error::TooLarge { width: 65535, height: 65535, bytes: 4 * 65535 * 65535, limit: 4 << 26 });
}

/// The chunks of a PNG of this type, together.
fn chunks(png: &[u8], name: &[u8; 4]) -> Vec<u8> {
    let (mut found, mut rest) = (Vec::new(), &png[8..]);
    while let Some((head, tail)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        if head[4..] == name[..] {
            found.extend_from_slice(&tail[..length]);
        }
        rest = &tail[length + 4..];
    }
    found
}

/// 64 MB of zeros in a few kilobytes: more than a picture of this size may take, so it is decoded without its profile.
#[test]
fn a_huge_colour_profile_is_left_out() {
    let zeros = chunks(&png(&vec![0; 8192 * 8192], 8192, 8192, ExtendedColorType::L8), b"IDAT");
    let mut chunk = b"iCCPname\0\0".to_vec();
    chunk.extend(&zeros);
    let mut bytes = png(&[1, 2, 3, 4], 2, 2, ExtendedColorType::L8);
    let length = (chunk.len() - 4) as u32;
    let profile = [length.to_be_bytes().to_vec(), chunk.clone(), crc32(&chunk).to_be_bytes().to_vec()].concat();
    // After the signature and the header.
    bytes.splice(33..33, profile);
    assert!(bytes.len() < 1 << 20, "{}", bytes.len());
    let decoded = decode_image(&bytes, 100_000_000).unwrap();
    assert_eq!(decoded.data()[..8], [1, 1, 1, 255, 2, 2, 2, 255]);
}

#[test]
fn a_jpeg_too_short_for_its_size_is_refused() {
    let mut bytes = gray_jpeg(&[90; 16 * 16], 16, 16);
    let header = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    bytes[header + 5..header + 9].copy_from_slice(&[0x27, 0x10, 0x27, 0x10]);
    let reason = decode_failure(decode_image(&bytes, NO_LIMIT), &bytes);
    assert!(reason.contains("ends before its picture"), "{reason}");
}

#[test]
fn the_limit_itself_is_allowed() {
    let file = encode_png(picture(10, 10).view()).unwrap();
    assert!(decode_image(&file, 100).is_ok());
    assert_eq!(
        *decode_image(&file, 99).unwrap_err(),
        Error::TooLarge { width: 10, height: 10, bytes: 400, limit: 396 }
    );
}

/// The checksum of PNG chunks (ISO 3309), for the crafted header.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}
