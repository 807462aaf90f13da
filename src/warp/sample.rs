//! Bilinear sampling of the target photo (paper, section 3.2.1), and the nearest pixel for its depth.

use wide::{CmpGt, f32x4, i16x8, i32x4, u8x16, u16x8};

use crate::ImageView;

/// Four positions in the target, each between four pixels, to 1/256 of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Taps {
    /// Indices of the top left pixels of the four.
    pub index: i32x4,
    /// Indices of the nearest pixels of the four.
    pub nearest: i32x4,
    /// Weights of the lower pixels, 0 to 256.
    pub lower: i32x4,
    /// Weights of the right pixels, 0 to 256, in the upper 16 bits, those of the left ones in the lower.
    pub across: i32x4,
}

/// One of them.
pub(super) struct Tap {
    pub index: usize,
    pub nearest: usize,
    pub lower: i32,
    pub across: i32,
}

impl Taps {
    /// To be overwritten.
    pub const NONE: Self = {
        let none = i32x4::ZERO;
        Self { index: none, nearest: none, lower: none, across: none }
    };

    /// The positions (x, y), which must lie inside an image of the given size.
    #[inline(always)]
    pub fn new([x, y]: [f32x4; 2], (width, height): (usize, usize)) -> Self {
        let fixed = |v: f32x4| (v * 256.0 + f32x4::splat(0.5)).trunc_int();
        // In the last column and row the pixel before is the first of the four, so that its neighbours exist.
        let last = |side: usize| i32x4::splat(side.saturating_sub(2) as i32);
        let whole = |v: i32x4, last: i32x4| (v >> 8_i32).min(last).max(i32x4::splat(0));
        // In large images rounding may exceed the border by the last digit.
        let share = |v: i32x4, whole: i32x4| (v - (whole << 8_i32)).min(i32x4::splat(256));
        let (x, y) = (fixed(x), fixed(y));
        let (ix, iy) = (whole(x, last(width)), whole(y, last(height)));
        let (right, lower) = (share(x, ix), share(y, iy));
        let index = iy * i32x4::splat(width as i32) + ix;
        let half = i32x4::splat(128);
        // A comparison that holds is −1.
        let nearest = index - right.cmp_gt(half) + (lower.cmp_gt(half) & i32x4::splat(width as i32));
        let across = i32x4::splat(256) - right + (right << 16_i32);
        Self { index, nearest, lower, across }
    }

    /// The one in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Tap {
        let number = |numbers: &i32x4| numbers.as_array_ref()[lane];
        Tap {
            index: number(&self.index) as usize,
            nearest: number(&self.nearest) as usize,
            lower: number(&self.lower),
            across: number(&self.across),
        }
    }
}

impl Tap {
    /// RGBA from the lowest byte up, rounded and opaque: interpolated vertically, both columns at once, then horizontally.
    #[inline(always)]
    pub fn colour(&self, image: &ImageView<'_>) -> u32 {
        // From the first of the four pixels to the last.
        let pixels = image.pixels().get(self.index..self.index + image.width() + 2).unwrap_or_default();
        let (Some(top), Some(bottom)) = (pixels.first_chunk(), pixels.last_chunk()) else {
            return 0; // never, as the position lies inside
        };
        let (top, bottom) = (channels(top), channels(bottom));
        let columns = (top << 8_u16) + (bottom - top) * u16x8::splat(self.lower as u16);
        // The pairwise product is of signed numbers, so these are shifted by 2¹⁵, which the weights make 2²³.
        let [r, g, b, a, right_r, right_g, right_b, right_a] = bytemuck::cast(columns ^ u16x8::splat(1 << 15));
        let pairs = i16x8::new([r, right_r, g, right_g, b, right_b, a, right_a]);
        let shares: i16x8 = bytemuck::cast(i32x4::splat(self.across));
        let sums = pairs.dot(shares) + i32x4::splat((1 << 23) + (1 << 15));
        let words = i16x8::from_i32x8_saturate(bytemuck::cast([sums >> 16_i32; 2]));
        let [rg, ba, ..] = words.dot(bytemuck::cast(i32x4::splat(1 | 256 << 16))).to_array();
        rg as u32 | (ba as u32) << 16 | OPAQUE
    }
}

/// The channels of two pixels.
#[inline(always)]
fn channels(pixels: &[[u8; 4]; 2]) -> u16x8 {
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(pixels.as_flattened());
    u16x8::from_u8x16_low(u8x16::new(bytes))
}

/// The colour at a place inside an image of at least two pixels a side, opaque.
pub(crate) fn bilinear(image: &ImageView<'_>, place: [f64; 2]) -> [u8; 4] {
    let taps = Taps::new(place.map(|p| f32x4::splat(p as f32)), image.size());
    taps.get(0).colour(image).to_le_bytes()
}

/// The alpha of a colour.
pub(super) const OPAQUE: u32 = 0xff00_0000;

/// ‖a − b‖² over RGB: the photometric error of two colours.
#[inline(always)]
pub(super) fn photometric_error(a: u32, b: u32) -> i32 {
    let channels = |colour: u32| i16x8::from_u8x16_low(bytemuck::cast(i32x4::splat((colour & !OPAQUE) as i32)));
    let apart = channels(a) - channels(b);
    let [rg, b, ..] = apart.dot(apart).to_array();
    rg + b
}
