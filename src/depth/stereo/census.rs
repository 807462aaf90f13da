//! Matching cost: how differently two windows order their pixels' brightness (census, Zabih & Woodfill 1994), which
//! neither exposure nor contrast changes.

use wide::{CmpGt, i8x16, i32x4, u8x16};

use super::epipolar_line::{Field, Motion};
use super::gray::{Corners, FRACTION, Gray, LANES, MARGIN, pad};
use crate::Result;
use crate::image::zeroed;

/// Labels per pixel: steps along the epipolar line, as many to either side of the middle one.
pub(super) const LABELS: usize = 15;
pub(super) const HALF: i32 = LABELS as i32 / 2;
/// Costs of the labels of a pixel; the last lane is none.
pub(super) type Costs = u8x16;

/// Half the census window.
const RADIUS: usize = 3;
const ROWS: usize = 2 * RADIUS + 1;
/// Cost of a place outside the other photo: worse than most matches, better than most mistakes.
const OUTSIDE: u8 = 16;
/// Cost of a label beyond the range, and of the lane that is none.
const NEVER: u8 = 100;
/// Cost per pixel of motion away from the prior.
const AWAY: f32 = 0.1;
/// Labels from the prior that the table of their own costs reaches to.
const TABLE: i32 = 1024;

/// All labels outside the other photo.
const NOWHERE: u16 = (1 << LABELS) - 1;
/// The bit of each label, in a byte for the first eight and one for the others.
const BITS: u8x16 = u8x16::new([1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128]);
/// The lane that is no label.
const NONE: u8x16 = u8x16::new([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255]);

/// Everything one search looks at: pixels of one photo, at 1/`scale` of its size, and their places in the other.
pub(super) struct Search<'a> {
    pub from: &'a Gray,
    pub to: &'a Gray,
    pub field: &'a Field<'a>,
    /// Pixels of the photos per pixel of the search.
    pub scale: usize,
    /// Pixels of motion in the other photo per label.
    pub step: f32,
    /// Label, counted from the prior, in the middle of each pixel's labels.
    pub middle: &'a [i16],
    /// Farthest from the prior, in pixels of motion.
    pub range: f32,
    /// Cost of any motion away from the prior.
    pub stay: u8,
    /// From each label that is looked at to the next that is.
    pub every: usize,
}

/// Makes the costs row by row.
pub(super) struct CostRows<'a> {
    search: &'a Search<'a>,
    to: Corners,
    /// The last rows of the other photo as each label sees them, less 128 as a signed byte.
    seen: Vec<u8>,
    /// Which labels of the last rows lie outside the other photo, one to a bit.
    outside: Vec<u16>,
    /// What a label costs by itself, from -TABLE on.
    own: Vec<u8>,
    /// Rows seen, and rows given out.
    ahead: usize,
    next: usize,
}

/// The places of a block's labels in the other photo, in fixed point: both axes of the first, and from one to the next.
/// Pixel 4i + q is lane i of vector q.
#[derive(Clone, Copy, Default)]
struct Rays([[i32x4; 4]; 4]);

impl Rays {
    /// Sets pixel `i`, whose labels start at `first`, and tells which of them lie beyond the first or the last pixel of the
    /// other photo, one to a bit.
    #[inline(always)]
    fn set(&mut self, i: usize, motion: &Motion, first: f32, every: i32, most: [i32; 2]) -> u16 {
        const ONE: f32 = (1 << FRACTION) as f32;
        // Far outside any photo, and far from an overflow.
        const FAR: f32 = (1 << 29) as f32;
        let fixed = |v: f32| if v.abs() < FAR { v as i32 } else { -(1 << 29) };
        let [px, py] = motion.place;
        let [dx, dy] = motion.direction;
        let ray = [px + first * dx, py + first * dy, dx, dy].map(|v| fixed(v * ONE));
        let [x, y, dx, dy] = ray;
        for (vectors, v) in self.0.iter_mut().zip([x, y, dx * every, dy * every]) {
            bytemuck::cast_mut::<_, [[i32; 4]; 4]>(vectors)[i % 4][i / 4 % 4] = v;
        }
        let within = |v: i32, most: i32| (0..=most).contains(&v);
        let inside = |k: i32| within(x + k * dx, most[0]) && within(y + k * dy, most[1]);
        if inside(0) && inside(LABELS as i32 - 1) {
            return 0;
        }
        (0..LABELS as i32).map(|k| u16::from(!inside(k)) << k).sum()
    }
}

impl<'a> CostRows<'a> {
    pub fn new(search: &'a Search<'a>) -> Result<Self> {
        let Search { from, to, step, range, stay, .. } = *search;
        let own = (-TABLE..=TABLE).map(|label| {
            let distance = (label as f32 * step).abs();
            let away = distance * AWAY + 0.5;
            let away = if away < f32::from(NEVER / 2) { away as u8 } else { NEVER / 2 };
            if distance > range { NEVER } else { away + stay * u8::from(label != 0) }
        });
        Ok(Self {
            search,
            to: Corners::new(to)?,
            seen: zeroed(ROWS * LABELS * from.stride)?,
            outside: zeroed(ROWS * from.width)?,
            own: own.collect(),
            ahead: 0,
            next: 0,
        })
    }

    /// The costs of the next row.
    #[inline(never)]
    pub fn next(&mut self, out: &mut [Costs]) {
        let from = self.search.from;
        let y = self.next;
        while self.ahead < from.height && self.ahead <= y + RADIUS {
            self.see();
        }
        self.next += 1;
        let width = from.width;
        let rows: [&[u8]; ROWS] = std::array::from_fn(|i| from.row((y + i) as isize - RADIUS as isize));
        let slots: [usize; ROWS] = std::array::from_fn(|i| slot((y + i).saturating_sub(RADIUS).min(from.height - 1)));
        let middle = &self.search.middle[y * width..][..width];
        let outside = &self.outside[slot(y) * width..][..width];
        for (chunk, ((out, middle), outside)) in
            out.chunks_mut(LANES).zip(middle.chunks(LANES)).zip(outside.chunks(LANES)).enumerate()
        {
            let mut census = [u8x16::splat(0); LANES];
            if outside.iter().any(|&outside| outside != NOWHERE) {
                self.census(&rows, &slots, MARGIN + chunk * LANES, &mut census);
            }
            for (((out, middle), &outside), census) in out.iter_mut().zip(middle).zip(outside).zip(census) {
                let first = (i32::from(*middle) - HALF + TABLE) as usize;
                let own = self.own.get(first..).and_then(|own| own.first_chunk()).unwrap_or(&[NEVER; 16]);
                let outside = outside.to_le_bytes().map(|bits| u64::from(bits) * 0x0101_0101_0101_0101);
                let outside = (bytemuck::cast::<_, u8x16>(outside) & BITS).cmp_eq(BITS);
                let own = u8x16::new(*own) + outside.blend(u8x16::splat(OUTSIDE), census);
                *out = NONE.blend(u8x16::splat(NEVER), own);
            }
        }
    }

    /// How bright the other photo is where the first and the last label of a pixel of the row that was looked at last lead to;
    /// and 1, but 0 if one of them is outside.
    #[inline(always)]
    pub fn ends(&self, x: usize) -> [f32; 3] {
        let (from, slot) = (self.search.from, slot(self.ahead - 1));
        let outside = self.outside[slot * from.width + x];
        let end = |label: usize| f32::from(self.seen[(slot * LABELS + label) * from.stride + MARGIN + x] ^ 0x80);
        let inside = outside & (1 | 1 << (LABELS - 1)) == 0;
        [end(0), end(LABELS - 1), f32::from(u8::from(inside))]
    }

    /// Looks at the next row of the other photo through its labels.
    #[inline(never)]
    pub fn see(&mut self) {
        let search = self.search;
        let y = self.ahead;
        self.ahead += 1;
        let (width, stride) = (search.from.width, search.from.stride);
        let outside = &mut self.outside[slot(y) * width..][..width];
        let seen = &mut self.seen[slot(y) * LABELS * stride..][..LABELS * stride];
        let middle = &search.middle[y * width..][..width];
        let (most, inverse) = (self.to.most(), 1.0 / search.scale as f32);
        let mut rays = Rays::default();
        for (block, (middle, outside)) in middle.chunks(LANES).zip(outside.chunks_mut(LANES)).enumerate() {
            let x = block * LANES;
            for (i, (&middle, outside)) in middle.iter().zip(outside.iter_mut()).enumerate() {
                let first = f32::from(middle) - HALF as f32;
                *outside = rays.set(i, &search.motion(x + i, y, inverse), first, search.every as i32, most);
            }
            // Nothing is seen there, and nothing is made of what was seen before.
            if outside.iter().all(|&outside| outside == NOWHERE) {
                continue;
            }
            let [u, v, du, dv] = &mut rays.0;
            for row in seen.chunks_exact_mut(stride).step_by(search.every) {
                let mut four = i32x4::splat(i32::from_ne_bytes([0x80; 4]));
                for q in 0..4 {
                    four ^= self.to.sample(u[q], v[q]) << (8 * q as i32);
                    u[q] += du[q];
                    v[q] += dv[q];
                }
                if let Some(row) = row[MARGIN + x..].first_chunk_mut::<LANES>() {
                    *row = bytemuck::cast(four);
                }
            }
        }
        seen.chunks_exact_mut(stride).for_each(|row| pad(row, width));
    }

    /// How many of the 48 neighbours are darker than the middle in one window and not in the other: of 16 pixels, for every
    /// label.
    #[inline(never)]
    fn census(&self, from: &[&[u8]; ROWS], slots: &[usize; ROWS], first: usize, out: &mut [u8x16; LANES]) {
        let stride = self.search.from.stride;
        let mut darker = [[i8x16::splat(0); ROWS]; ROWS];
        let sign = i8x16::splat(i8::MIN);
        let middle = lanes(window(from[RADIUS], first), RADIUS) ^ sign;
        for (darker, row) in darker.iter_mut().zip(from) {
            let row = window(row, first);
            for (dx, darker) in darker.iter_mut().enumerate() {
                *darker = middle.cmp_gt(lanes(row, dx) ^ sign);
            }
        }
        for (k, out) in out.iter_mut().enumerate().take(LABELS) {
            let row = |i: usize| window(&self.seen[(slots[i] * LABELS + k) * stride..], first);
            let middle = lanes(row(RADIUS), RADIUS);
            let mut count = i8x16::splat(0);
            for (i, darker) in darker.iter().enumerate() {
                let row = row(i);
                let differs = |dx: usize| middle.cmp_gt(lanes(row, dx)) ^ darker[dx];
                // Written out, so that nothing is counted but pixels.
                count =
                    count - differs(0) - differs(1) - differs(2) - differs(3) - differs(4) - differs(5) - differs(6);
            }
            *out = bytemuck::cast(count);
        }
        // To the labels of each pixel: a transposition by perfect shuffles.
        for _ in 0..4 {
            let from = *out;
            for (i, out) in out.chunks_exact_mut(2).enumerate() {
                let [a, b] = [from[i], from[i + LANES / 2]];
                out.copy_from_slice(&[u8x16::unpack_low(a, b), u8x16::unpack_high(a, b)]);
            }
        }
    }
}

fn slot(y: usize) -> usize {
    y % ROWS
}

/// All of a row that windows around 16 pixels from `first` on contain.
#[inline(always)]
fn window(row: &[u8], first: usize) -> &[u8; LANES + 2 * RADIUS] {
    row.get(first - RADIUS..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; LANES + 2 * RADIUS])
}

#[inline(always)]
fn lanes(window: &[u8; LANES + 2 * RADIUS], dx: usize) -> i8x16 {
    bytemuck::cast(window[dx..].first_chunk::<LANES>().copied().unwrap_or_default())
}

impl Search<'_> {
    /// The motion of a pixel, in pixels of the search per label; `inverse` is that of the scale.
    #[inline(always)]
    fn motion(&self, x: usize, y: usize, inverse: f32) -> Motion {
        // Blocks are looked up at one of their pixels, which is not quite the middle.
        let shift = (self.scale / 2) as f32;
        let motion = self.field.motion(x, y, self.scale);
        Motion {
            place: motion.place.map(|p| (p - shift) * inverse),
            direction: motion.direction.map(|d| d * (self.step * inverse)),
        }
    }
}
