//! Where the reference, or the mosaic so far, lies on the canvas.

use crate::distance::{distance, to_outside};
use crate::{ImageView, Rect, Result};

/// The reference on the canvas.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub photo: ImageView<'a>,
    /// Canvas position of its top left pixel.
    pub left: usize,
    pub top: usize,
}

impl<'a> Placed<'a> {
    /// What it covers of the canvas.
    pub fn frame(&self) -> Rect {
        Rect { x: self.left, y: self.top, width: self.photo.width(), height: self.photo.height() }
    }

    /// The reference's row in a row of the canvas; `None` above and below it.
    pub fn row(&self, y: usize) -> Option<&'a [[u8; 4]]> {
        let width = self.photo.width();
        let row = y.checked_sub(self.top).filter(|&row| row < self.photo.height())?;
        Some(&self.photo.pixels()[row * width..(row + 1) * width])
    }

    /// Whether a pixel of the reference is one.
    #[inline]
    pub fn is_valid(&self, pixel: [u8; 4]) -> bool {
        self.photo.is_there(pixel)
    }

    /// How far the reference's pixels are from its border, on a canvas of this size.
    pub fn border_distance(&self, (width, height): (usize, usize)) -> Result<BorderDistance> {
        let outside = |i: usize| self.pixel(self.row(i / width), i % width).is_none();
        let masked = self.photo.is_masked().then(|| distance(width * height, width, &outside)).transpose()?;
        Ok(BorderDistance { frame: self.frame(), masked, width })
    }

    /// The reference's pixel at a position of the canvas.
    #[inline]
    pub fn pixel(&self, row: Option<&[[u8; 4]]>, x: usize) -> Option<[u8; 4]> {
        row?.get(x.wrapping_sub(self.left)).copied().filter(|&pixel| self.is_valid(pixel))
    }
}

/// How far pixels of the reference are from where it is not, masked pixels included.
pub(super) struct BorderDistance {
    frame: Rect,
    /// Of every pixel of the canvas; `None` where the frame says it.
    masked: Option<Vec<u16>>,
    /// Of the canvas.
    width: usize,
}

impl BorderDistance {
    /// At a position of the canvas within the frame, as [`distance`] counts it.
    #[inline]
    pub fn at(&self, (x, y): (usize, usize)) -> u32 {
        let Rect { x: left, y: top, width, height } = self.frame;
        let edge = to_outside((x - left, y - top), (width, height));
        self.masked.as_ref().map_or(edge, |masked| edge.min(masked[y * self.width + x].into()))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use crate::Image;
    use crate::distance::STRAIGHT;

    #[test]
    fn a_masked_part_is_beyond_the_border() {
        let (width, height) = (20, 9);
        let photo = |masked: usize| {
            let pixel = |i: usize| [50, 60, 70, if i % width < masked { 0 } else { 255 }];
            Image::new((0..width * height).flat_map(pixel).collect(), width, height).unwrap()
        };
        for (masked, expected) in [(0, [5, 5, 1]), (8, [3, 5, 1])] {
            let photo = photo(masked);
            let placed = Placed { photo: photo.view(), left: 4, top: 2 };
            let distance = placed.border_distance((30, 15)).unwrap();
            let found = [(4 + 10, 2 + 4), (4 + 14, 2 + 4), (4 + 19, 2 + 4)].map(|at| distance.at(at) / STRAIGHT);
            assert_eq!(found, expected, "{masked}");
        }
    }
}
