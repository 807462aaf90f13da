//! Bilinear sampling of the target: its photo and its depth alike.

use wide::{f32x4, i32x4, u8x16, u16x8};

use crate::ImageView;

/// Four places in the target, each between four pixels, to 1/256 of a pixel.
pub(super) struct Taps {
    /// Indices of the top left pixels of the four.
    index: i32x4,
    /// Shares of the right and of the lower pixels, 0 to 256.
    fx: i32x4,
    fy: i32x4,
    /// Steps to the right and to the lower neighbour; 0 in a picture one pixel wide or high.
    right: usize,
    down: usize,
}

impl Taps {
    /// The places (x, y) of a picture of the given size, which must lie inside it.
    #[inline(always)]
    pub fn new([x, y]: [f32x4; 2], (width, height): (usize, usize)) -> Self {
        let fixed = |v: f32x4| (v * 256.0 + f32x4::splat(0.5)).trunc_int();
        // The last column and row are reached from the pixel before, so that the neighbours exist.
        let last = |side: usize| i32x4::splat(side.saturating_sub(2) as i32);
        let whole = |v: i32x4, last: i32x4| (v >> 8_i32).min(last).max(i32x4::splat(0));
        // In large pictures rounding may lead out by the last digit.
        let share = |v: i32x4, whole: i32x4| (v - (whole << 8_i32)).min(i32x4::splat(256));
        let (x, y) = (fixed(x), fixed(y));
        let (ix, iy) = (whole(x, last(width)), whole(y, last(height)));
        Self {
            index: iy * i32x4::splat(width as i32) + ix,
            fx: share(x, ix),
            fy: share(y, iy),
            right: usize::from(width > 1),
            down: if height > 1 { width } else { 0 },
        }
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> usize {
        self.index.as_array_ref()[lane] as usize
    }

    #[inline(always)]
    fn shares(&self, lane: usize) -> [i32; 2] {
        [self.fx.as_array_ref()[lane], self.fy.as_array_ref()[lane]]
    }

    /// RGBA, rounded: first down, both columns at once, then across.
    #[inline(always)]
    pub fn colour(&self, lane: usize, image: &ImageView<'_>) -> [u8; 4] {
        let (index, [fx, fy]) = (self.index(lane), self.shares(lane));
        let (data, top, bottom) = (image.data(), 4 * index, 4 * (index + self.down));
        let (Some(top), Some(bottom)) = (data.get(top..top + 8), data.get(bottom..bottom + 8)) else {
            return image.pixels()[index]; // the last pixel of a picture one pixel wide
        };
        let share = |v: i32| u16x8::splat(v as u16);
        let columns = widen(top) * share(256 - fy) + widen(bottom) * share(fy);
        let [left, right]: [u64; 2] = bytemuck::cast(columns);
        // Two channels share a word, 32 bit each.
        const EVEN: u64 = 0xffff_0000_ffff;
        const HALF: u64 = 1 << 15 | 1 << 47;
        let (near, far) = ((256 - fx) as u64, fx as u64);
        let across = |left: u64, right: u64| (left & EVEN) * near + (right & EVEN) * far + HALF;
        let (rb, ga) = (across(left, right) >> 16, across(left >> 16, right >> 16) >> 8);
        const CHANNELS: u64 = 0xff_0000_00ff;
        let both = rb & CHANNELS | ga & CHANNELS << 8; // r g . . b a . .
        [both as u8, (both >> 8) as u8, (both >> 32) as u8, (both >> 40) as u8]
    }

    /// The value of a map of the same size at the nearest pixel.
    #[inline(always)]
    pub fn nearest(&self, lane: usize, map: &[f32]) -> f32 {
        let [fx, fy] = self.shares(lane);
        let right = if fx > 128 { self.right } else { 0 };
        let down = if fy > 128 { self.down } else { 0 };
        map[self.index(lane) + right + down]
    }
}

/// The channels of two pixels next to each other.
#[inline(always)]
fn widen(pixels: &[u8]) -> u16x8 {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(pixels);
    u16x8::from_u8x16_low(u8x16::new(bytes))
}
