//! Matching cost: the Hamming distance of the census transforms of two windows (Zabih & Woodfill 1994), which neither
//! exposure nor contrast changes.

use wide::{CmpGt, i8x16, i32x4, u8x16};

use super::epipolar_line::{EpipolarLine, EpipolarLines};
use super::gray::{Corners, FRACTION, Gray, MARGIN, pad};
use crate::Result;
use crate::image::zeroed;
use crate::lanes::BYTE_LANES;

/// Labels per pixel: steps along the epipolar line, as many to either side of the middle one.
pub(super) const LABELS: usize = 15;
pub(super) const HALF: i32 = LABELS as i32 / 2;
/// Costs of the labels of a pixel; the last lane is none.
pub(super) type Costs = u8x16;

/// Half the census window.
pub(super) const RADIUS: usize = 3;
const ROWS: usize = 2 * RADIUS + 1;
/// Cost of a place outside the other photo, or where that is masked, of 48: worse than most correct matches, better than most wrong ones. Tuned on
/// the evaluation cases: PSNR, coverage and bending are flat between 8 and 32.
const OUTSIDE: u8 = 16;
/// Cost of a label beyond the range, and of the lane that is no label: with it no sum of costs overflows a byte.
const NEVER: u8 = 100;
/// Cost per pixel of distance from the prior. Tuned on the evaluation cases: 0.05 bends the outside 6 % more, 0.2 costs 0.6 % of
/// PSNR.
const AWAY: f32 = 0.1;
/// The table of the labels' own costs reaches this many labels either side of the prior: more than any range.
const TABLE: i32 = 1024;

/// All labels outside the other photo.
const NOWHERE: u16 = (1 << LABELS) - 1;
/// The bit of each label, in a byte for the first eight and one for the others.
const BITS: u8x16 = u8x16::new([1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128]);
/// The lane that is no label.
const NONE: u8x16 = u8x16::new([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255]);

/// What is searched: pixels of one photo, at 1/`scale` of its size, along their epipolar lines in the other.
pub(super) struct Search<'a> {
    pub from: &'a Gray,
    pub to: &'a Gray,
    pub lines: &'a EpipolarLines<'a>,
    /// Pixels of the photos per pixel of the search.
    pub scale: usize,
    /// Pixels along the epipolar line per label.
    pub step: f32,
    /// Label, counted from the prior, in the middle of each pixel's labels.
    pub middle: &'a [i16],
    /// Farthest from the prior, in pixels along the epipolar line.
    pub range: f32,
    /// Cost of any label but the prior's own.
    pub leaving_cost: u8,
    /// Only every so many labels are sampled.
    pub every: usize,
}

/// Makes the costs row by row.
pub(super) struct CostRows<'a> {
    search: &'a Search<'a>,
    to: Corners,
    /// The last rows of the other photo, sampled at each label, less 128 as a signed byte.
    sampled: Vec<u8>,
    /// Which labels of the last rows lie outside the other photo, one to a bit.
    outside: Vec<u16>,
    /// What a label costs by itself, from -TABLE on.
    own: Vec<u8>,
    /// Rows sampled, and rows whose costs were made.
    ahead: usize,
    next: usize,
}

/// Places of a block's labels in the other photo, in fixed point: both axes of the first, and from one to the next.
/// Pixel 4i + q is lane i of vector q.
#[derive(Clone, Copy, Default)]
struct Rays([[i32x4; 4]; 4]);

impl Rays {
    /// Sets pixel `i`, whose labels start at `first`, and returns which of them lie beyond the first or the last pixel of the
    /// other photo, one to a bit.
    #[inline(always)]
    fn set(&mut self, i: usize, line: &EpipolarLine, first: f32, every: i32, most: [i32; 2]) -> u16 {
        const ONE: f32 = (1 << FRACTION) as f32;
        // Far outside any photo, and far from an overflow.
        const FAR: f32 = (1 << 29) as f32;
        let fixed = |v: f32| if v.abs() < FAR { v as i32 } else { -(1 << 29) };
        let [px, py] = line.place;
        let [dx, dy] = line.direction;
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
        let Search { from, to, step, range, leaving_cost, .. } = *search;
        let own = (-TABLE..=TABLE).map(|label| {
            let distance = (label as f32 * step).abs();
            let away = distance * AWAY + 0.5;
            let away = if away < f32::from(NEVER / 2) { away as u8 } else { NEVER / 2 };
            if distance > range { NEVER } else { away + leaving_cost * u8::from(label != 0) }
        });
        Ok(Self {
            search,
            to: Corners::new(to)?,
            sampled: zeroed(ROWS * LABELS * from.stride)?,
            outside: zeroed(ROWS * from.width)?,
            own: own.collect(),
            ahead: 0,
            next: 0,
        })
    }

    /// The costs of the next row.
    pub fn next(&mut self, out: &mut [Costs]) {
        let from = self.search.from;
        let y = self.next;
        while self.ahead < from.height && self.ahead <= y + RADIUS {
            self.sample_row();
        }
        self.next += 1;
        let width = from.width;
        let rows: [&[u8]; ROWS] = std::array::from_fn(|i| from.row((y + i) as isize - RADIUS as isize));
        let slots: [usize; ROWS] = std::array::from_fn(|i| slot((y + i).saturating_sub(RADIUS).min(from.height - 1)));
        let middle = &self.search.middle[y * width..][..width];
        let outside = &self.outside[slot(y) * width..][..width];
        for (chunk, ((out, middle), outside)) in
            out.chunks_mut(BYTE_LANES).zip(middle.chunks(BYTE_LANES)).zip(outside.chunks(BYTE_LANES)).enumerate()
        {
            let mut census = [u8x16::splat(0); BYTE_LANES];
            if outside.iter().any(|&outside| outside != NOWHERE) {
                self.census(&rows, &slots, MARGIN + chunk * BYTE_LANES, &mut census);
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

    /// Gray values of the other photo at the first and the last label of a pixel of the row that was sampled last; and 1,
    /// but 0 if one of them is outside.
    #[inline(always)]
    pub fn ends(&self, x: usize) -> [f32; 3] {
        let (from, slot) = (self.search.from, slot(self.ahead - 1));
        let outside = self.outside[slot * from.width + x];
        let end = |label: usize| f32::from(self.sampled[(slot * LABELS + label) * from.stride + MARGIN + x] ^ 0x80);
        let inside = outside & (1 | 1 << (LABELS - 1)) == 0;
        [end(0), end(LABELS - 1), f32::from(u8::from(inside))]
    }

    /// Samples the other photo at the labels of the next row.
    pub fn sample_row(&mut self) {
        let search = self.search;
        let y = self.ahead;
        self.ahead += 1;
        let (width, stride) = (search.from.width, search.from.stride);
        let outside = &mut self.outside[slot(y) * width..][..width];
        let sampled = &mut self.sampled[slot(y) * LABELS * stride..][..LABELS * stride];
        let middle = &search.middle[y * width..][..width];
        let (most, inverse) = (self.to.most(), 1.0 / search.scale as f32);
        let masked = search.from.is_masked() || search.to.is_masked();
        let mut rays = Rays::default();
        for (block, (middle, outside)) in middle.chunks(BYTE_LANES).zip(outside.chunks_mut(BYTE_LANES)).enumerate() {
            let x = block * BYTE_LANES;
            for (i, (&middle, outside)) in middle.iter().zip(outside.iter_mut()).enumerate() {
                let first = f32::from(middle) - HALF as f32;
                let line = search.line(x + i, y, inverse);
                *outside = rays.set(i, &line, first, search.every as i32, most);
                if masked && *outside != NOWHERE {
                    *outside |= search.missing([x + i, y], &line, first);
                }
            }
            // Nothing is sampled there, and nothing is made of what was sampled before.
            if outside.iter().all(|&outside| outside == NOWHERE) {
                continue;
            }
            let [u, v, du, dv] = &mut rays.0;
            for row in sampled.chunks_exact_mut(stride).step_by(search.every) {
                let mut four = i32x4::splat(i32::from_ne_bytes([0x80; 4]));
                for q in 0..4 {
                    four ^= self.to.sample(u[q], v[q]) << (8 * q as i32);
                    u[q] += du[q];
                    v[q] += dv[q];
                }
                if let Some(row) = row[MARGIN + x..].first_chunk_mut::<BYTE_LANES>() {
                    *row = bytemuck::cast(four);
                }
            }
        }
        sampled.chunks_exact_mut(stride).for_each(|row| pad(row, width));
    }

    /// How many of the 48 neighbours are darker than the middle in one window and not in the other: of 16 pixels, for every
    /// label.
    fn census(&self, from: &[&[u8]; ROWS], slots: &[usize; ROWS], first: usize, out: &mut [u8x16; BYTE_LANES]) {
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
            let row = |i: usize| window(&self.sampled[(slots[i] * LABELS + k) * stride..], first);
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
                let [a, b] = [from[i], from[i + BYTE_LANES / 2]];
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
fn window(row: &[u8], first: usize) -> &[u8; BYTE_LANES + 2 * RADIUS] {
    row.get(first - RADIUS..).and_then(<[u8]>::first_chunk).unwrap_or(&[0; BYTE_LANES + 2 * RADIUS])
}

#[inline(always)]
fn lanes(window: &[u8; BYTE_LANES + 2 * RADIUS], dx: usize) -> i8x16 {
    bytemuck::cast(window[dx..].first_chunk::<BYTE_LANES>().copied().unwrap_or_default())
}

impl Search<'_> {
    /// The labels of a pixel that lie where the other photo is masked, one to a bit: all of them where its own is.
    fn missing(&self, [x, y]: [usize; 2], line: &EpipolarLine, first: f32) -> u16 {
        if self.from.is_missing([x as f32, y as f32]) {
            return NOWHERE;
        }
        let place = |k: usize| [0, 1].map(|c| line.place[c] + (first + k as f32) * line.direction[c]);
        // No label is farther from the middle one, with what rounding to pixels adds.
        let [dx, dy] = line.direction.map(f32::abs);
        let reach = (HALF as f32 * if dx > dy { dx } else { dy }) as usize + 2;
        if self.to.is_there_around(place(LABELS / 2), reach) {
            return 0;
        }
        (0..LABELS).map(|k| u16::from(self.to.is_missing(place(k))) << k).sum()
    }

    /// The epipolar line of a pixel, in pixels of the search per label; `inverse` is that of the scale.
    #[inline(always)]
    fn line(&self, x: usize, y: usize, inverse: f32) -> EpipolarLine {
        // Blocks are looked up at one of their pixels, which is not quite the middle.
        let shift = (self.scale / 2) as f32;
        let line = self.lines.line(x, y, self.scale);
        EpipolarLine {
            place: line.place.map(|p| (p - shift) * inverse),
            direction: line.direction.map(|d| d * (self.step * inverse)),
        }
    }
}
