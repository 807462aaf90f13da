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

    /// The smallest rectangle around it that is made of the tiles of a picture of that size.
    pub(super) fn tiled(self, side: usize, (width, height): (usize, usize)) -> Self {
        let (x, y) = (self.x / side * side, self.y / side * side);
        let right = (self.x + self.width).next_multiple_of(side).min(width);
        let bottom = (self.y + self.height).next_multiple_of(side).min(height);
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
        let mut turn = |x: usize, height: usize| {
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
        };
        let mut before = 0;
        for (x, (height, pixel)) in heights.iter_mut().zip(row.as_chunks::<4>().0).enumerate() {
            *height = if pixel[3] == 0 { 0 } else { *height + 1 };
            // Most columns are as high as the one before.
            if *height != before {
                turn(x, *height);
                before = *height;
            }
        }
        // A column of height 0 behind the last one closes all that are open.
        turn(image.width, 0);
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
    let row = |y: usize| {
        let row = &image.data[4 * y * image.width..4 * (y + 1) * image.width];
        extent(row.as_chunks::<4>().0.iter().map(|pixel| pixel[3] != 0))
    };
    Ok(bounding_box(image.height, &row))
}

/// From the first to behind the last one that is true; `None` when none is.
#[inline(always)]
pub(crate) fn extent(mut row: impl ExactSizeIterator<Item = bool> + DoubleEndedIterator) -> Option<Range<usize>> {
    let first = row.position(|inside| inside)?;
    let more = row.rposition(|inside| inside).map_or(0, |last| last + 1);
    Some(first..first + 1 + more)
}

/// The smallest rectangle around what `row` finds in each of so many rows; `None` when it finds nothing.
#[inline(never)]
pub(crate) fn bounding_box(rows: usize, row: &dyn Fn(usize) -> Option<Range<usize>>) -> Option<Rect> {
    let mut found: Option<Rect> = None;
    for (y, Range { start, end }) in (0..rows).filter_map(|y| Some((y, row(y)?))) {
        let Rect { x, y: top, width, .. } = found.unwrap_or(Rect { x: start, y, width: 0, height: 0 });
        let left = x.min(start);
        found = Some(Rect { x: left, y: top, width: end.max(x + width) - left, height: y + 1 - top });
    }
    found
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
