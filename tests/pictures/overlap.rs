//! Two pictures that overlap.

use depthstitch::mosaic::{BlendOptions, Mosaic, SeamGuide, blend};
use depthstitch::warp::Warped;
use depthstitch::{Image, Result};

use super::{picture, warped};

/// Smooth, with something to see everywhere.
pub fn texture(x: usize, y: usize) -> [u8; 3] {
    let wave = |a: usize, b: usize| (100 + (a * x + b * y) % 61 - (a * x * 7 + b * y * 3) % 23) as u8;
    [wave(3, 5), wave(7, 2), wave(1, 9)]
}

/// A canvas of 160×100 with the target where `valid`, and a reference of 100×100 on its right.
pub const CANVAS: (usize, usize) = (160, 100);
pub const LEFT: usize = 60;

pub fn stage(valid: impl Fn(usize, usize) -> bool, target: impl Fn(usize, usize) -> [u8; 3]) -> Warped {
    let image = picture(CANVAS.0, CANVAS.1, |x, y| {
        let [r, g, b] = target(x, y);
        // Colours under alpha 0 must not matter.
        if valid(x, y) { [r, g, b, 255] } else { [255, 0, (x * y) as u8, 0] }
    });
    warped(image, (LEFT, 0))
}

pub fn reference(pixel: impl Fn(usize, usize) -> [u8; 3]) -> Image {
    picture(CANVAS.0 - LEFT, CANVAS.1, |x, y| {
        let [r, g, b] = pixel(x + LEFT, y);
        [r, g, b, 255]
    })
}

/// The left 120 columns, less a few small holes.
pub fn overlapping(x: usize, y: usize) -> bool {
    x < 120 && !(x > 70 && x % 13 == 5 && y % 11 < 2)
}

pub fn compose(warped: &Warped, reference: &Image, options: &BlendOptions) -> Result<Mosaic> {
    blend(warped, reference.view(), &SeamGuide::default(), options, &mut ())
}
