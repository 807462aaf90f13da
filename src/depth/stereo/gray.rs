//! Gray images for matching: a pyramid from full size to small, and bilinear sampling.

use wide::{i16x8, i32x4};

use crate::distance::{DIAGONAL, STRAIGHT, distance};
use crate::image::{filled, zeroed};
use crate::lanes::BYTE_LANES;
use crate::luma::rec601_level;
use crate::transparency::distance_to_missing;
use crate::{ImageView, Result};

/// Pixels beyond the left border that repeat it, and at least as many beyond the right, so that windows need no bounds.
pub(super) const MARGIN: usize = 8;
/// Binary digits after the point of a place in fixed point.
pub(super) const FRACTION: i32 = 12;

/// Luma with a margin.
pub(super) struct Gray {
    data: Vec<u8>,
    /// The [`distance`] of each pixel from the nearest masked one, without a margin; `None` where none is.
    from_missing: Option<Vec<u16>>,
    pub width: usize,
    pub height: usize,
    pub stride: usize,
}

impl Gray {
    /// The luma of a photo (ITU-R BT.601).
    pub fn new(image: &ImageView<'_>) -> Result<Self> {
        let (width, height) = image.size();
        let mut rows = image.pixels().chunks_exact(width);
        let gray = Self::filled(width, height, |_, out| {
            let row = rows.next().unwrap_or_default();
            out.iter_mut().zip(row).for_each(|(out, &pixel)| *out = rec601_level(pixel));
        })?;
        Ok(Self { from_missing: distance_to_missing(*image)?, ..gray })
    }

    /// Half the size: means of 2×2 pixels, masked where one of them is.
    pub fn half(&self) -> Result<Self> {
        let half = Self::halved_values(self)?;
        let Some(from_missing) = &self.from_missing else { return Ok(half) };
        let mut missing = filled(half.width * half.height, false)?;
        for (at, _) in from_missing.iter().enumerate().filter(|(_, distance)| **distance == 0) {
            missing[at / self.width / 2 * half.width + at % self.width / 2] = true;
        }
        let from_missing = distance(missing.len(), half.width, &|at| missing[at])?;
        Ok(Self { from_missing: Some(from_missing), ..half })
    }

    fn halved_values(&self) -> Result<Self> {
        Self::filled(self.width.div_ceil(2), self.height.div_ceil(2), |y, out| {
            let (above, below) = (self.row(2 * y as isize), self.row(2 * y as isize + 1));
            let pairs = above[MARGIN..].chunks_exact(2).zip(below[MARGIN..].chunks_exact(2));
            for (out, (a, b)) in out.iter_mut().zip(pairs) {
                let sum: u32 = a.iter().chain(b).map(|&v| u32::from(v)).sum();
                *out = ((sum + 2) >> 2) as u8;
            }
        })
    }

    fn filled(width: usize, height: usize, mut fill: impl FnMut(usize, &mut [u8])) -> Result<Self> {
        let stride = width.next_multiple_of(BYTE_LANES) + 2 * MARGIN;
        let mut data: Vec<u8> = zeroed(stride * height)?;
        for (y, row) in data.chunks_exact_mut(stride).enumerate() {
            fill(y, &mut row[MARGIN..MARGIN + width]);
            pad(row, width);
        }
        Ok(Self { data, from_missing: None, width, height, stride })
    }

    /// Whether any pixel is masked.
    pub fn is_masked(&self) -> bool {
        self.from_missing.is_some()
    }

    /// Whether the pixel nearest to a place is masked; outside of the frame none is.
    #[inline]
    pub fn is_missing(&self, place: [f32; 2]) -> bool {
        self.distance_at(place) == Some(0)
    }

    /// Whether all pixels up to so many to either side of the nearest to a place, and above and below, are free of masks; that cannot be said outside of
    /// the frame.
    #[inline]
    pub fn is_there_around(&self, place: [f32; 2], pixels: usize) -> bool {
        !self.is_masked()
            || self.distance_at(place).is_some_and(|distance| distance as usize > pixels * DIAGONAL as usize)
    }

    /// Whether a pixel, row by row, is at most so many away from a masked one.
    pub fn is_near_missing(&self, at: usize, pixels: u32) -> bool {
        let distance = self.from_missing.as_ref().and_then(|distances| distances.get(at));
        distance.is_some_and(|&distance| u32::from(distance) <= pixels * STRAIGHT)
    }

    /// The distance of the pixel nearest to a place from a masked one; `None` outside of the frame.
    #[inline]
    fn distance_at(&self, place: [f32; 2]) -> Option<u16> {
        let [x, y] = place.map(|v| v + 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32;
        let distances = self.from_missing.as_ref().filter(|_| inside)?;
        distances.get(y as usize * self.width + x as usize).copied()
    }

    /// Row `y`, clamped to the frame; pixel x is at `MARGIN + x`.
    #[inline]
    pub fn row(&self, y: isize) -> &[u8] {
        let y = y.clamp(0, self.height as isize - 1) as usize;
        &self.data[y * self.stride..(y + 1) * self.stride]
    }
}

/// An image to be sampled: each pixel with those to the right, below, and below to the right, one to a byte. Beyond the
/// border, where there is no weight, is anything.
pub(super) struct Corners {
    data: Vec<i32>,
    width: usize,
    height: usize,
}

impl Corners {
    pub fn new(gray: &Gray) -> Result<Self> {
        let (width, height) = (gray.width, gray.height);
        let mut data: Vec<i32> = zeroed(width * height)?;
        for (y, out) in (0..).zip(data.chunks_exact_mut(width)) {
            let [above, below] = [y, y + 1].map(|y| gray.row(y)[MARGIN..].windows(2));
            for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
                *out = i32::from_le_bytes([a[0], a[1], b[0], b[1]]);
            }
        }
        Ok(Self { data, width, height })
    }

    /// The places of the last column and row in fixed point.
    pub fn most(&self) -> [i32; 2] {
        [self.width, self.height].map(|side| ((side - 1) as i32) << FRACTION)
    }

    /// Bilinear values at four places in fixed point, clamped to the frame.
    #[inline(always)]
    pub fn sample(&self, x: i32x4, y: i32x4) -> i32x4 {
        let [last_x, last_y] = self.most().map(i32x4::splat);
        let (x, y) = (x.max(i32x4::splat(0)).min(last_x), y.max(i32x4::splat(0)).min(last_y));
        let at = (y >> FRACTION) * i32x4::splat(self.width as i32) + (x >> FRACTION);
        let four = i32x4::new(at.to_array().map(|at| self.data.get(at as usize).copied().unwrap_or_default()));
        // Six digits after the point, and the same 16 bit higher.
        let low = |v: i32x4| (v >> (FRACTION - 6)) & i32x4::splat(63);
        let high = |v: i32x4| (v << (22 - FRACTION)) & i32x4::splat(63 << 16);
        // Both rows at once, 16 bit each.
        let sixteen = |v: i32x4| bytemuck::cast::<_, i16x8>(v);
        let bytes = i32x4::splat(0x00ff_00ff);
        let right = low(x) | high(x);
        let left = i32x4::splat(0x0040_0040) - right;
        let columns = sixteen(four & bytes) * sixteen(left) + sixteen((four >> 8) & bytes) * sixteen(right);
        let rows = columns.dot(sixteen(high(y) + i32x4::splat(64) - low(y)));
        (rows + i32x4::splat(2048)) >> 12
    }
}

/// Repeats the first and the last of `width` values into the margins.
pub(super) fn pad<T: Copy>(row: &mut [T], width: usize) {
    let (first, last) = (row[MARGIN], row[MARGIN + width - 1]);
    row[..MARGIN].fill(first);
    row[MARGIN + width..].fill(last);
}
