//! Bilinear sampling at one place of the target: its photo and its depth alike.

use wide::{u8x16, u16x8};

use crate::ImageView;

/// A place in the target between four pixels, to 1/256 of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Tap {
    /// Index of the top left pixel of the four.
    index: usize,
    /// Steps to the right and to the lower neighbour; 0 in a picture one pixel wide or high.
    right: usize,
    down: usize,
    /// Share of the right and of the lower pixels, 0 to 256.
    fx: i32,
    fy: i32,
}

impl Tap {
    /// The place (x, y) of a picture of the given size, which must lie inside it.
    #[inline(always)]
    pub fn new([x, y]: [f64; 2], (width, height): (usize, usize)) -> Self {
        let (x, y) = ((x * 256.0 + 0.5) as i32, (y * 256.0 + 0.5) as i32);
        // The last column and row are reached from the pixel before, so that the neighbours exist.
        let clamp = |v: i32, side: usize| (v >> 8).clamp(0, side.saturating_sub(2) as i32);
        let (ix, iy) = (clamp(x, width), clamp(y, height));
        Self {
            index: iy as usize * width + ix as usize,
            right: usize::from(width > 1),
            down: if height > 1 { width } else { 0 },
            fx: x - (ix << 8),
            fy: y - (iy << 8),
        }
    }

    /// RGBA, rounded: first down, both columns at once, then across.
    #[inline(always)]
    pub fn colour(&self, image: &ImageView<'_>) -> [u8; 4] {
        let (data, top, bottom) = (image.data(), 4 * self.index, 4 * (self.index + self.down));
        let (Some(top), Some(bottom)) = (data.get(top..top + 8), data.get(bottom..bottom + 8)) else {
            return image.pixels()[self.index]; // the last pixel of a picture one pixel wide
        };
        let share = |v: i32| u16x8::splat(v as u16);
        let columns = widen(top) * share(256 - self.fy) + widen(bottom) * share(self.fy);
        let [left, right]: [u64; 2] = bytemuck::cast(columns);
        // Two channels share a word, 32 bit each.
        const EVEN: u64 = 0xffff_0000_ffff;
        const HALF: u64 = 1 << 15 | 1 << 47;
        let (near, far) = ((256 - self.fx) as u64, self.fx as u64);
        let across = |left: u64, right: u64| (left & EVEN) * near + (right & EVEN) * far + HALF;
        let (rb, ga) = (across(left, right) >> 16, across(left >> 16, right >> 16) >> 8);
        const CHANNELS: u64 = 0xff_0000_00ff;
        let both = rb & CHANNELS | ga & CHANNELS << 8; // r g . . b a . .
        [both as u8, (both >> 8) as u8, (both >> 32) as u8, (both >> 40) as u8]
    }

    /// The value of a map of the same size at the nearest pixel.
    #[inline(always)]
    pub fn nearest(&self, map: &[f32]) -> f32 {
        let right = if self.fx > 128 { self.right } else { 0 };
        let down = if self.fy > 128 { self.down } else { 0 };
        map[self.index + right + down]
    }
}

/// The channels of two pixels next to each other.
#[inline(always)]
fn widen(pixels: &[u8]) -> u16x8 {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(pixels);
    u16x8::from_u8x16_low(u8x16::new(bytes))
}
