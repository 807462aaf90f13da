//! Pictures and masks by formula, and an observer that remembers.
#![allow(dead_code)] // each test uses its own part

pub mod overlap;

use depthstitch::observer::Observer;
use depthstitch::warp::Warped;
use depthstitch::{Image, Mask, Stage};

pub fn picture(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [u8; 4]) -> Image {
    let data = (0..width * height).flat_map(|i| pixel(i % width, i / width)).collect();
    Image::new(data, width, height).unwrap()
}

pub fn mask(width: usize, height: usize, inside: impl Fn(usize, usize) -> bool) -> Mask {
    let data = (0..width * height).map(|i| if inside(i % width, i / width) { 255 } else { 0 }).collect();
    Mask::new(data, width, height).unwrap()
}

pub fn pixels(image: &Image) -> &[[u8; 4]] {
    image.pixels()
}

/// A target that was warped without depth, drawn where it is not transparent.
pub fn warped(image: Image, offset: (usize, usize)) -> Warped {
    let (width, height) = image.size();
    let footprint = Mask::new(pixels(&image).iter().map(|p| p[3]).collect(), width, height).unwrap();
    Warped { image, footprint, confidence: None, depth: None, offset, clipped: false }
}

/// Follows a call of one stage, and stops it at a fraction.
pub struct Watch {
    stage: Stage,
    pub seen: Vec<f32>,
    stop_at: Option<f32>,
}

impl Watch {
    pub fn new(stage: Stage) -> Self {
        Self { stage, seen: Vec::new(), stop_at: None }
    }

    pub fn until(stage: Stage, fraction: f32) -> Self {
        Self { stop_at: Some(fraction), ..Self::new(stage) }
    }
}

impl Observer for Watch {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        assert_eq!(stage, self.stage);
        self.seen.push(fraction);
        self.stop_at.is_none_or(|limit| fraction < limit)
    }
}
