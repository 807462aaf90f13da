//! What is left of a canvas once the outline is clean.

use super::Warped;
use crate::rect::{Rect, bounding_box, extent};
use crate::{Image, InverseDepth, Mask};

impl Warped {
    /// Leaves of the canvas what the target's footprint and the reference, of this size, need: nothing is where all that lay farther out
    /// was dropped.
    pub(super) fn trimmed(self, reference: (usize, usize)) -> Self {
        let (width, height) = self.footprint.size();
        let drawn =
            |y: usize| extent(self.footprint.data()[y * width..(y + 1) * width].iter().map(|&drawn| drawn != 0));
        let (x, y) = self.offset;
        let reference = Rect { x, y, width: reference.0, height: reference.1 };
        let kept = bounding_box(height, &drawn).map_or(reference, |drawn| drawn.joined(reference));
        let size = (kept.width, kept.height);
        if size == (width, height) {
            return self;
        }
        let mask = |mask: Mask| Mask::from_bytes(cropped(mask.into_data(), 1, width, kept), size.0, size.1);
        let depth = |depth: InverseDepth| {
            InverseDepth::from_values(cropped(depth.into_values(), 1, width, kept), size.0, size.1)
        };
        Self {
            image: Image::from_bytes(cropped(self.image.into_data(), 4, width, kept), size.0, size.1),
            footprint: mask(self.footprint),
            confidence: self.confidence.map(mask),
            depth: self.depth.map(depth),
            offset: (x - kept.x, y - kept.y),
            clipped: self.clipped,
        }
    }
}

/// A rectangle of `data` of this width, so many numbers a pixel, where it lies.
fn cropped<T: bytemuck::NoUninit + bytemuck::AnyBitPattern>(
    mut data: Vec<T>,
    count: usize,
    width: usize,
    kept: Rect,
) -> Vec<T> {
    move_rows(bytemuck::cast_slice_mut(&mut data), count * size_of::<T>(), width, kept);
    data.truncate(count * kept.width * kept.height);
    data
}

/// Moves the rows of a rectangle to the front, `size` bytes a pixel.
fn move_rows(data: &mut [u8], size: usize, width: usize, kept: Rect) {
    for row in 0..kept.height {
        let from = size * ((kept.y + row) * width + kept.x);
        data.copy_within(from..from + size * kept.width, size * row * kept.width);
    }
}
