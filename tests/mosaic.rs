//! Blending through the public functions.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod pictures;

use depthstitch::warp::Warped;
use depthstitch::{Error, Image, Mask};
use pictures::{mask, picture, pixels};

const EMPTY: [u8; 4] = [0; 4];

mod blending {
    #[cfg(target_arch = "wasm32")]
    use super::test;
    use super::*;
    use depthstitch::mosaic::{BlendOptions, Mosaic, SeamGuide};
    use depthstitch::{ImageView, Result};

    /// The plain average.
    fn blend(warped: &Warped, reference: ImageView<'_>) -> Result<Mosaic> {
        depthstitch::mosaic::blend(warped, reference, &SeamGuide::default(), &BlendOptions::paper(), &mut ())
    }

    fn warped(image: Image, footprint: Mask, offset: (usize, usize)) -> Warped {
        Warped { image, footprint, confidence: None, depth: None, offset, clipped: false }
    }

    /// Target and reference, valid or not, black or not; a reference of 1×1 has neighbours that it does not cover.
    #[test]
    fn truth_table() {
        let cases = [
            ([10, 20, 31, 255], [20, 20, 30, 255], [15, 20, 31, 255]),
            ([0, 0, 0, 255], [100, 1, 255, 255], [50, 1, 128, 255]),
            ([100, 1, 255, 255], [0, 0, 0, 128], [50, 1, 128, 255]),
            ([100, 1, 255, 255], [0, 0, 0, 127], [100, 1, 255, 255]),
            ([0, 0, 0, 255], [0, 0, 0, 255], [0, 0, 0, 255]),
            ([255, 255, 255, 255], [255, 255, 254, 200], [255, 255, 255, 255]),
            (EMPTY, [7, 8, 9, 0], EMPTY),
            (EMPTY, [7, 8, 9, 128], [7, 8, 9, 255]),
            (EMPTY, [0, 0, 0, 255], [0, 0, 0, 255]),
            ([70, 80, 90, 0], [7, 8, 9, 255], [7, 8, 9, 255]),
        ];
        for (target, reference, expected) in cases {
            let canvas = picture(3, 3, |_, _| target);
            let mosaic =
                blend(&warped(canvas, mask(3, 3, |_, _| true), (1, 1)), picture(1, 1, |_, _| reference).view())
                    .unwrap();
            let alone = if target[3] != 0 { target } else { EMPTY };
            for (i, &pixel) in pixels(&mosaic.image).iter().enumerate() {
                assert_eq!(pixel, if i == 4 { expected } else { alone });
            }
        }
    }

    #[test]
    fn every_pair_of_levels_is_rounded_to_nearest() {
        let canvas = picture(256, 256, |x, y| [x as u8, y as u8, 255 - x as u8, 255]);
        let reference = picture(256, 256, |x, y| [y as u8, x as u8, y as u8, 255]);
        let mosaic = blend(&warped(canvas, mask(256, 256, |_, _| true), (0, 0)), reference.view()).unwrap();
        for (i, pixel) in pixels(&mosaic.image).iter().enumerate() {
            let (x, y) = (i % 256, i / 256);
            let mean = |a: usize, b: usize| (a + b).div_ceil(2) as u8;
            assert_eq!(*pixel, [mean(x, y), mean(x, y), mean(255 - x, y), 255]);
        }
    }

    #[test]
    fn the_reference_lies_at_the_offset_and_voids_are_what_is_left_of_the_footprint() {
        let (width, height, offset) = (13, 9, (4, 2));
        let valid = |x: usize, y: usize| (x + 2 * y) % 5 < 2;
        let drawn = |x: usize, y: usize| (x + 2 * y) % 5 < 4;
        let under = |x: usize, y: usize| (4..10).contains(&x) && (2..7).contains(&y);
        let canvas = picture(width, height, |x, y| if valid(x, y) { [200, 0, 0, 255] } else { EMPTY });
        let reference = picture(6, 5, |x, y| [0, x as u8, y as u8, 255]);
        let mosaic = blend(&warped(canvas, mask(width, height, drawn), offset), reference.view()).unwrap();
        for (i, &pixel) in pixels(&mosaic.image).iter().enumerate() {
            let (x, y) = (i % width, i / width);
            let expected = match (valid(x, y), under(x, y)) {
                (true, true) => [100, (x - 4).div_ceil(2) as u8, (y - 2).div_ceil(2) as u8, 255],
                (true, false) => [200, 0, 0, 255],
                (false, true) => [0, (x - 4) as u8, (y - 2) as u8, 255],
                (false, false) => EMPTY,
            };
            assert_eq!(pixel, expected, "at {x}, {y}");
            let void = drawn(x, y) && !valid(x, y) && !under(x, y);
            assert_eq!(mosaic.voids.data()[i], if void { 255 } else { 0 }, "at {x}, {y}");
        }
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let reference = picture(6, 5, |_, _| [1, 2, 3, 255]);
        let canvas = |width, height| picture(width, height, |_, _| EMPTY);
        let whole = |width, height| mask(width, height, |_, _| true);
        let wrong = |name, expected, actual| Err(Error::WrongSize { name, expected, actual }.into());
        let right = warped(canvas(8, 8), whole(8, 8), (3, 0));
        assert_eq!(blend(&right, reference.view()), wrong("canvas", (9, 8), (8, 8)));
        let low = warped(canvas(8, 8), whole(8, 8), (2, 4));
        assert_eq!(blend(&low, reference.view()), wrong("canvas", (8, 9), (8, 8)));
        let footprint = warped(canvas(8, 8), whole(16, 4), (0, 0));
        assert_eq!(blend(&footprint, reference.view()), wrong("footprint", (8, 8), (16, 4)));
    }
}

mod composition {
    #[cfg(target_arch = "wasm32")]
    use super::test;
    use super::*;
    use depthstitch::mosaic::{BlendOptions, Blending, Composition, Exposure, Layer};

    /// A mosaic goes on beyond what a photo that is added covers: its seam needs that, and a ramp may be wider than bands.
    #[test]
    fn seam_and_ramp_do_not_depend_on_bands() {
        let texture = |x: usize, y: usize, more: u8| {
            let level = (100 + (3 * x + 5 * y) % 61 - (7 * x + 3 * y) % 23) as u8 + more;
            [level, level, level, 255]
        };
        let first = picture(600, 200, |x, y| texture(x, y, 0));
        let image = picture(900, 200, |x, y| if x < 300 { EMPTY } else { texture(x, y, 30) });
        let footprint = mask(900, 200, |x, _| x >= 300);
        let added = Warped { image, footprint, confidence: None, depth: None, offset: (0, 0), clipped: false };
        let with = |bands: u32| {
            let blending = Blending::Feather;
            let options = BlendOptions { bands, blending, feather: 200, exposure: Exposure::Off, ..Default::default() };
            let mut set = Composition::of(first.view(), None, 1).unwrap();
            set.add(&added, [0, 0], Layer { label: 2, gains: None, matches: &[] }, &options, &mut ()).unwrap();
            set
        };
        let (few, many) = (with(1), with(6));
        assert!(few.labels == many.labels && few.image == many.image);
    }
}
