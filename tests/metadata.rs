//! Colour profiles and EXIF data: what goes into a file, and what comes back.
#![cfg(feature = "codecs")]
#![allow(clippy::unwrap_used)]

use depthstitch::codecs::{
    Metadata, convert_colours, decode_image, encode_jpeg, encode_png, focal_length, read_metadata,
};
use depthstitch::{Error, Image};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const NO_LIMIT: u64 = u64::MAX;
const MAKE: &[u8] = b"Camera maker\0";
const DATE: &[u8] = b"2026:11:22 12:00:00\0";
const THUMBNAIL: &[u8] = b"\xff\xd8 a thumbnail \xff\xd9";

fn picture() -> Image {
    let pixel = |i: usize| [(i % 40 * 6) as u8, (i / 40 * 8) as u8, (255 - i % 251) as u8, 255];
    Image::new((0..40 * 30).flat_map(pixel).collect(), 40, 30).unwrap()
}

fn display_p3() -> Vec<u8> {
    moxcms::ColorProfile::new_display_p3().encode().unwrap()
}

/// Numbers in one byte order.
struct Writer {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl Writer {
    fn short(&mut self, v: u16) {
        self.bytes.extend(if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
    }
    fn long(&mut self, v: u32) {
        self.bytes.extend(if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
    }
    fn entry(&mut self, tag: u16, kind: u16, count: u32, value: u32) {
        self.short(tag);
        self.short(kind);
        self.long(count);
        if kind == 3 {
            self.short(value as u16);
            self.short(0);
        } else {
            self.long(value);
        }
    }
}

/// As a camera on its side writes it: the maker, the orientation, the time, the size, and a thumbnail at the end.
fn exif(big_endian: bool) -> Vec<u8> {
    let mut w = Writer { bytes: if big_endian { b"MM".to_vec() } else { b"II".to_vec() }, big_endian };
    let first = 8;
    let second = first + 2 + 3 * 12 + 4;
    let make = second + 2 + 4 * 12 + 4;
    let date = make + MAKE.len() as u32 + 1;
    let thumbnail_directory = date + DATE.len() as u32;
    let thumbnail = thumbnail_directory + 2 + 2 * 12 + 4;
    w.short(42);
    w.long(first);
    w.short(3);
    w.entry(0x010f, 2, MAKE.len() as u32, make);
    w.entry(0x0112, 3, 1, 6);
    w.entry(0x8769, 4, 1, second);
    w.long(thumbnail_directory);
    w.short(4);
    // Text in UTF-8, and a directory's place: types that newer cameras write.
    w.entry(0x9003, 129, DATE.len() as u32, date);
    w.entry(0x014a, 13, 1, 8);
    w.entry(0xa002, 3, 1, 4000);
    w.entry(0xa003, 4, 1, 3000);
    w.long(0);
    w.bytes.extend(MAKE);
    w.bytes.push(0);
    w.bytes.extend(DATE);
    w.short(2);
    w.entry(0x0201, 4, 1, thumbnail);
    w.entry(0x0202, 4, 1, THUMBNAIL.len() as u32);
    w.long(0);
    w.bytes.extend(THUMBNAIL);
    w.bytes
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

fn files(metadata: &Metadata) -> [Vec<u8>; 2] {
    [encode_png(picture().view(), metadata).unwrap(), encode_jpeg(picture().view(), 90, metadata).unwrap()]
}

#[test]
fn a_profile_comes_back_as_it_was() {
    let metadata = Metadata { colour_profile: Some(display_p3()), exif: None };
    for file in files(&metadata) {
        assert_eq!(read_metadata(&file, NO_LIMIT).unwrap(), metadata);
    }
    for file in files(&Metadata::default()) {
        assert_eq!(read_metadata(&file, NO_LIMIT).unwrap(), Metadata::default());
    }
    assert!(contains(&files(&metadata)[0], b"iCCP") && contains(&files(&metadata)[1], b"ICC_PROFILE\0\x01\x01"));
}

#[test]
fn camera_data_fit_the_new_picture() {
    for big_endian in [false, true] {
        let given = exif(big_endian);
        for file in files(&Metadata { colour_profile: None, exif: Some(given.clone()) }) {
            // Not turned by what was the orientation of the photo.
            assert_eq!(decode_image(&file, NO_LIMIT).unwrap().size(), (40, 30));
            assert!(!contains(&file, THUMBNAIL));
            let exif = read_metadata(&file, NO_LIMIT).unwrap().exif.unwrap();
            let long = |at: usize| {
                let bytes = *exif[at..].first_chunk().unwrap();
                if big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
            };
            let short = |at: usize| {
                let bytes = *exif[at..].first_chunk().unwrap();
                if big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
            };
            // Maker and time are as before, up to the thumbnail's directory, which nothing leads to.
            assert!(contains(&exif, MAKE) && contains(&exif, DATE));
            assert_eq!(short(10 + 12 + 8), 1);
            assert_eq!(long(8 + 2 + 36), 0);
            let second = long(10 + 24 + 8) as usize;
            assert_eq!([long(second + 2 + 24 + 8), long(second + 2 + 36 + 8)], [40, 30]);
            assert_eq!(exif.len(), given.len() - THUMBNAIL.len() - 2 - 24 - 4);
        }
    }
}

#[test]
fn damaged_camera_data_are_left_out() {
    let whole = exif(false);
    let mut random = 12345u32;
    for i in 0..2000 {
        let mut damaged = whole[..whole.len() - i % whole.len()].to_vec();
        for _ in 0..i % 4 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let at = random as usize % damaged.len();
            damaged[at] = (random >> 24) as u8;
        }
        let file = encode_jpeg(picture().view(), 90, &Metadata { colour_profile: None, exif: Some(damaged) }).unwrap();
        assert!(decode_image(&file, NO_LIMIT).is_ok());
    }
    let file = encode_jpeg(picture().view(), 90, &Metadata { colour_profile: None, exif: Some(vec![7; 40]) }).unwrap();
    assert_eq!(read_metadata(&file, NO_LIMIT).unwrap().exif, None);
}

/// What a camera says of its lens: tag, type, and value, of which a fraction has two numbers.
fn lens(big_endian: bool, entries: &[(u16, u16, [u32; 2])]) -> Vec<u8> {
    let mut w = Writer { bytes: if big_endian { b"MM".to_vec() } else { b"II".to_vec() }, big_endian };
    let fractions = 26 + 2 + 12 * entries.len() as u32 + 4;
    w.short(42);
    w.long(8);
    w.short(1);
    w.entry(0x8769, 4, 1, 26);
    w.long(0);
    w.short(entries.len() as u16);
    for (i, (tag, kind, [value, _])) in entries.iter().enumerate() {
        w.entry(*tag, *kind, 1, if *kind == 5 { fractions + 8 * i as u32 } else { *value });
    }
    w.long(0);
    for number in entries.iter().flat_map(|(.., value)| value) {
        w.long(*number);
    }
    w.bytes
}

#[test]
fn the_focal_length_is_read() {
    let equivalent = (0xa405, 3, [28, 0]);
    let sides = [(0xa002, 4, [4000, 0]), (0xa003, 3, [3000, 0])];
    // 6.2 mm at 5000 pixels to the inch.
    let sensor = [(0x920a, 5, [62, 10]), (0xa20e, 5, [50_000, 10])];
    for big_endian in [false, true] {
        let found = |entries: &[_], size| focal_length(&lens(big_endian, entries), size);
        let near = |found: Option<f64>, expected: f64| assert!((found.unwrap() - expected).abs() < 0.1, "{found:?}");
        // 28 mm of the 43.27 mm that the diagonal of 35 mm film has, of 1000 and of 5000 pixels.
        near(found(&[equivalent], (800, 600)), 647.1);
        near(found(&[equivalent, sides[0], sides[1]], (3000, 4000)), 3235.5);
        near(found(&[sensor[0], sides[0], sides[1], sensor[1]], (800, 600)), 244.1);
        near(found(&[sensor[0], sides[0], sides[1], sensor[1], (0xa210, 3, [3, 0])], (4000, 3000)), 3100.0);
        // Cropped to another shape, nothing to go by, and nonsense.
        assert_eq!(found(&[equivalent, sides[0], sides[1]], (800, 450)), None);
        assert_eq!(found(&[sensor[0], sensor[1]], (800, 600)), None);
        assert_eq!(found(&sides, (800, 600)), None);
        assert_eq!(found(&[(0xa405, 3, [0, 0])], (800, 600)), None);
        assert_eq!(found(&[(0xa405, 3, [60_000, 0])], (800, 600)), None);
        assert_eq!(found(&[(0x920a, 5, [62, 0]), sides[0], sides[1], sensor[1]], (800, 600)), None);
        let whole = lens(big_endian, &[equivalent]);
        (0..whole.len() - 14).for_each(|end| assert_eq!(focal_length(&whole[..end], (800, 600)), None));
    }
}

#[test]
fn colours_are_converted() {
    let p3 = display_p3();
    let mut image = Image::new([[255, 255, 255, 9], [128, 128, 128, 0], [200, 60, 40, 255]].concat(), 3, 1).unwrap();
    let before = image.clone();
    convert_colours(&mut image, None, Some(&p3)).unwrap();
    // Grays and alpha stay; a red of sRGB is less of a red in the larger space (CSS Color 4's matrices: 187.7, 71.5, 50.4).
    assert_eq!(image.pixels()[..2], before.pixels()[..2]);
    let [r, g, b, a] = image.pixels()[2];
    assert!(r.abs_diff(187) <= 2 && g.abs_diff(71) <= 2 && b.abs_diff(50) <= 3 && a == 255, "{r} {g} {b}");
    convert_colours(&mut image, Some(&p3), None).unwrap();
    for (back, was) in image.data().iter().zip(before.data()) {
        assert!(back.abs_diff(*was) <= 2);
    }
    let error = *convert_colours(&mut image, Some(&[1; 200]), None).unwrap_err();
    assert!(matches!(error, Error::DecodeFailed { bytes: 200, .. }));
}
