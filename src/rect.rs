//! Rectangles of whole pixels.

use std::ops::Range;

/// An axis-aligned rectangle of whole pixels: columns x to x + width, rows y to y + height, ends excluded.
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

/// Length of the diagonal of an image of this width and height.
pub(crate) fn diagonal((width, height): (usize, usize)) -> f64 {
    let (width, height) = (width as f64, height as f64);
    (width * width + height * height).sqrt()
}

/// `side` × `side` points all over an image of this width and height, row by row, its corners among them.
pub(crate) fn grid_points((width, height): (usize, usize), side: usize) -> impl Iterator<Item = [f64; 2]> {
    let at = move |i: usize, length: usize| i as f64 / (side - 1) as f64 * (length - 1) as f64;
    (0..side * side).map(move |i| [at(i % side, width), at(i / side, height)])
}

impl Rect {
    /// The rectangle grown by `margin` pixels on each side and clipped to an image of the given size.
    pub(crate) fn grown(self, margin: usize, (width, height): (usize, usize)) -> Self {
        let (x, y) = (self.x.saturating_sub(margin), self.y.saturating_sub(margin));
        let right = (self.x + self.width + margin).min(width);
        let bottom = (self.y + self.height + margin).min(height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// The smallest rectangle around it that consists of whole tiles, `side` pixels wide and high, of an image of the given size.
    pub(crate) fn tiled(self, side: usize, (width, height): (usize, usize)) -> Self {
        let (x, y) = (self.x / side * side, self.y / side * side);
        let right = (self.x + self.width).next_multiple_of(side).min(width);
        let bottom = (self.y + self.height).next_multiple_of(side).min(height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// The smallest rectangle around it and another.
    pub(crate) fn joined(self, other: Self) -> Self {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = (self.x + self.width).max(other.x + other.width);
        let bottom = (self.y + self.height).max(other.y + other.height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// Its columns and rows.
    pub(crate) fn ranges(self) -> (Range<usize>, Range<usize>) {
        (self.x..self.x + self.width, self.y..self.y + self.height)
    }
}

/// From the first true value to just after the last one; `None` when none is true.
pub(crate) fn extent(mut row: impl ExactSizeIterator<Item = bool> + DoubleEndedIterator) -> Option<Range<usize>> {
    let first = row.position(|inside| inside)?;
    let more = row.rposition(|inside| inside).map_or(0, |last| last + 1);
    Some(first..first + 1 + more)
}

/// The bounding box of what `row` finds in each of the first `rows` rows; `None` when it finds nothing.
#[inline(never)] // nor does `row` become a part of it, see `crate::rows`
pub(crate) fn bounding_box(rows: usize, row: &dyn Fn(usize) -> Option<Range<usize>>) -> Option<Rect> {
    let mut found: Option<Rect> = None;
    for (y, Range { start, end }) in (0..rows).filter_map(|y| Some((y, row(y)?))) {
        let Rect { x, y: top, width, .. } = found.unwrap_or(Rect { x: start, y, width: 0, height: 0 });
        let left = x.min(start);
        found = Some(Rect { x: left, y: top, width: end.max(x + width) - left, height: y + 1 - top });
    }
    found
}
