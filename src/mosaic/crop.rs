//! Rectangles of the mosaic that are worth keeping.

use std::ops::Range;

use crate::image::{check_len, reserve, zeroed};
use crate::{Error, Image, Result};

/// A rectangle of whole pixels: columns x to x + width, rows y to y + height, the last ones excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rect {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Rect {
    /// The rectangle with so many pixels more on each side, as far as a picture of that size reaches.
    pub(super) fn grown(self, margin: usize, (width, height): (usize, usize)) -> Self {
        let (x, y) = (self.x.saturating_sub(margin), self.y.saturating_sub(margin));
        let right = (self.x + self.width + margin).min(width);
        let bottom = (self.y + self.height + margin).min(height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// Its columns and rows.
    pub(super) fn ranges(self) -> (Range<usize>, Range<usize>) {
        (self.x..self.x + self.width, self.y..self.y + self.height)
    }
}

/// Which part of the mosaic is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Crop {
    /// All of the canvas.
    #[default]
    None,
    /// The largest rectangle without a transparent pixel: see [`inner`].
    Inner,
    /// The smallest rectangle with all opaque pixels: see [`bounds`].
    Bounds,
}

/// The largest rectangle, sides upright, in which every pixel is valid (alpha not 0); of several the first one from the
/// top, then from the left. `None` when no pixel is valid.
///
/// In each row the valid pixels above every column are a histogram, whose largest rectangle a stack of rising columns
/// finds in one pass: time is proportional to the pixels, memory to a row.
///
/// # Errors
/// `invalid-argument` or `size-mismatch` when the picture is not what its size says, `out-of-memory`.
pub fn inner(image: &Image) -> Result<Option<Rect>> {
    check_len("image", image.data.len(), image.width, image.height, 4)?;
    let mut heights: Vec<usize> = zeroed(image.width)?;
    let mut rising: Vec<(usize, usize)> = Vec::new(); // first column, height
    reserve(&mut rising, image.width)?;
    let mut best: Option<Rect> = None;
    for (y, row) in image.data.chunks_exact(4 * image.width).enumerate() {
        for (height, pixel) in heights.iter_mut().zip(row.as_chunks::<4>().0) {
            *height = if pixel[3] == 0 { 0 } else { *height + 1 };
        }
        // A column of height 0 behind the last one closes all that are open.
        for (x, height) in heights.iter().copied().chain([0]).enumerate() {
            let mut first = x;
            while let Some(&(start, tall)) = rising.last().filter(|(_, tall)| *tall > height) {
                rising.pop();
                first = start;
                let found = Rect { x: start, y: y + 1 - tall, width: x - start, height: tall };
                if best.is_none_or(|best| precedes(&found, &best)) {
                    best = Some(found);
                }
            }
            if height > 0 && rising.last().is_none_or(|(_, tall)| *tall < height) {
                rising.push((first, height));
            }
        }
    }
    Ok(best)
}

/// Whether `a` is larger than `b`, or as large and before it.
fn precedes(a: &Rect, b: &Rect) -> bool {
    let (area, other) = (a.width * a.height, b.width * b.height);
    area > other || area == other && (a.y, a.x) < (b.y, b.x)
}

/// The smallest rectangle that holds all valid pixels (alpha not 0). `None` when no pixel is valid.
///
/// # Errors
/// `invalid-argument` or `size-mismatch` when the picture is not what its size says.
pub fn bounds(image: &Image) -> Result<Option<Rect>> {
    check_len("image", image.data.len(), image.width, image.height, 4)?;
    let pixels = image.data.as_chunks::<4>().0;
    Ok(bounding_box((image.width, image.height), &|i| pixels[i][3] != 0))
}

/// The smallest rectangle with all pixels of a picture that `inside` is true of; `None` when there are none.
#[inline(never)]
pub(super) fn bounding_box((width, height): (usize, usize), inside: &dyn Fn(usize) -> bool) -> Option<Rect> {
    let (mut left, mut right, mut top, mut bottom) = (width, 0, height, 0);
    for y in 0..height {
        let at = |x: &usize| inside(y * width + x);
        if let Some(first) = (0..width).find(at) {
            (left, right) = (left.min(first), right.max(first + 1));
            right = (right..width).rfind(at).map_or(right, |last| last + 1);
            (top, bottom) = (top.min(y), y + 1);
        }
    }
    (left < width).then(|| Rect { x: left, y: top, width: right - left, height: bottom - top })
}

/// The part of a picture in a rectangle.
///
/// # Errors
/// `invalid-argument` when the rectangle is empty or leaves the picture, or the picture is empty; `size-mismatch` when
/// it is not what its size says; `out-of-memory`.
pub fn cropped(image: &Image, rect: Rect) -> Result<Image> {
    check_len("image", image.data.len(), image.width, image.height, 4)?;
    for (name, first, side, whole) in
        [("crop width", rect.x, rect.width, image.width), ("crop height", rect.y, rect.height, image.height)]
    {
        if side == 0 || first.checked_add(side).is_none_or(|end| end > whole) {
            return Err(Error::InvalidArgument { name, expected: "within the picture", value: side as f64 }.into());
        }
    }
    let mut data = Vec::new();
    reserve(&mut data, 4 * rect.width * rect.height)?;
    for row in image.data.chunks_exact(4 * image.width).skip(rect.y).take(rect.height) {
        data.extend_from_slice(&row[4 * rect.x..4 * (rect.x + rect.width)]);
    }
    Ok(Image { data, width: rect.width, height: rect.height })
}
