//! Matching cost: how differently two windows order their pixels' brightness (census, Zabih & Woodfill 1994), which
//! neither exposure nor contrast changes.

use wide::{CmpGt, i8x16, i32x4};

use super::gray::{FRACTION, Gray, LANES, MARGIN, pad};
use super::motion::{Field, Motion};
use crate::Result;
use crate::image::zeroed;

/// Labels per pixel: steps along the epipolar line, as many to either side of the middle one.
pub(super) const LABELS: usize = 15;
pub(super) const HALF: i32 = LABELS as i32 / 2;
/// Costs of the labels of a pixel; the last lane is none.
pub(super) type Costs = [u8; 16];

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
}

/// Makes the costs row by row.
pub(super) struct CostRows<'a> {
    search: &'a Search<'a>,
    /// The last rows of the other photo as each label sees them.
    seen: Vec<i8>,
    /// Which labels of the last rows lie outside the other photo, one to a bit.
    outside: Vec<u16>,
    motions: Vec<Motion>,
    rays: Vec<Rays>,
    /// What a label costs by itself, from -TABLE on.
    own: Vec<u8>,
    /// Rows seen, and rows given out.
    ahead: usize,
    next: usize,
}

/// The places of four pixels' labels in the other photo, in fixed point.
#[derive(Clone, Copy, Default)]
struct Rays {
    first: [i32x4; 2],
    step: [i32x4; 2],
}

impl Rays {
    /// Sets pixel `i`, whose labels start at `first`.
    #[inline(always)]
    fn set(&mut self, i: usize, motion: &Motion, first: f32) {
        const ONE: f32 = (1 << FRACTION) as f32;
        // Far outside any photo, and far from an overflow.
        const FAR: f32 = (1 << 29) as f32;
        let fixed = |v: f32| if v.abs() < FAR { v as i32 } else { -(1 << 29) };
        for axis in 0..2 {
            let (place, direction) = (motion.place[axis], motion.direction[axis]);
            self.first[axis].as_array_mut()[i] = fixed((place + first * direction) * ONE);
            self.step[axis].as_array_mut()[i] = fixed(direction * ONE);
        }
    }

    /// Which labels of pixel `i` lie beyond the first or the last pixel, one to a bit.
    #[inline(always)]
    fn outside(&self, i: usize, most: [i32; 2]) -> u16 {
        let at = |k: i32, axis: usize| self.first[axis].as_array_ref()[i] + k * self.step[axis].as_array_ref()[i];
        let inside = |k: i32| (0..2).all(|axis| (0..=most[axis]).contains(&at(k, axis)));
        if inside(0) && inside(LABELS as i32 - 1) {
            return 0;
        }
        (0..LABELS as i32).map(|k| u16::from(!inside(k)) << k).sum()
    }
}

impl<'a> CostRows<'a> {
    pub fn new(search: &'a Search<'a>) -> Result<Self> {
        let Search { from, step, range, stay, .. } = *search;
        let own = (-TABLE..=TABLE).map(|label| {
            let distance = (label as f32 * step).abs();
            let away = (distance * AWAY + 0.5).min(f32::from(NEVER / 2)) as u8;
            if distance > range { NEVER } else { away + stay * u8::from(label != 0) }
        });
        Ok(Self {
            search,
            seen: zeroed(ROWS * LABELS * from.stride)?,
            outside: vec![0; ROWS * from.width],
            motions: vec![Motion::default(); from.width],
            rays: vec![Rays::default(); from.width.div_ceil(4)],
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
            let census = self.census(&rows, &slots, MARGIN + chunk * LANES);
            for (i, ((out, &middle), &outside)) in out.iter_mut().zip(middle).zip(outside).enumerate() {
                let first = (i32::from(middle) - HALF + TABLE) as usize;
                let own = self.own.get(first..).and_then(|own| own.first_chunk::<16>()).unwrap_or(&[NEVER; 16]);
                let mut costs: Costs = std::array::from_fn(|k| if k < LABELS { own[k] + census[k][i] } else { NEVER });
                if outside != 0 {
                    for (k, cost) in costs.iter_mut().take(LABELS).enumerate() {
                        if outside >> k & 1 != 0 {
                            *cost = own[k] + OUTSIDE;
                        }
                    }
                }
                *out = costs;
            }
        }
    }

    /// Looks at the next row of the other photo through every label.
    #[inline(never)]
    fn see(&mut self) {
        let Search { from, to, .. } = *self.search;
        let y = self.ahead;
        self.ahead += 1;
        self.search.motions(y, &mut self.motions);
        let (width, stride) = (from.width, from.stride);
        let outside = &mut self.outside[slot(y) * width..][..width];
        let middle = &self.search.middle[y * width..][..width];
        let most = [to.width, to.height].map(|side| ((side - 1) as i32) << FRACTION);
        for (x, ((motion, &middle), outside)) in self.motions.iter().zip(middle).zip(outside).enumerate() {
            let rays = &mut self.rays[x / 4];
            rays.set(x % 4, motion, f32::from(middle) - HALF as f32);
            *outside = rays.outside(x % 4, most);
        }
        let seen = &mut self.seen[slot(y) * LABELS * stride..][..LABELS * stride];
        let bias = i32x4::splat(0x80);
        for (row, k) in seen.chunks_exact_mut(stride).zip(0..) {
            let k = i32x4::splat(k);
            for (seen, rays) in row[MARGIN..].chunks_exact_mut(4).zip(&self.rays) {
                let [u, v] = [0, 1].map(|axis| rays.first[axis] + k * rays.step[axis]);
                let value = to.sample(u, v) ^ bias;
                seen.iter_mut().zip(value.to_array()).for_each(|(seen, value)| *seen = value as i8);
            }
            pad(row, width);
        }
    }

    /// How many of the 48 neighbours are darker than the middle in one window and not in the other: for every label,
    /// at 16 pixels.
    #[inline(never)]
    fn census(&self, from: &[&[u8]; ROWS], slots: &[usize; ROWS], first: usize) -> [[u8; LANES]; LABELS] {
        let stride = self.search.from.stride;
        let mut darker = [[i8x16::splat(0); ROWS]; ROWS];
        let sign = i8x16::splat(i8::MIN);
        let load_from = |row: &[u8], at: usize| bytemuck::cast::<[u8; LANES], i8x16>(lanes(row, at)) ^ sign;
        let middle = load_from(from[RADIUS], first);
        for (darker, row) in darker.iter_mut().zip(from) {
            for (dx, darker) in darker.iter_mut().enumerate() {
                *darker = middle.cmp_gt(load_from(row, first + dx - RADIUS));
            }
        }
        std::array::from_fn(|k| {
            let row = |i: usize| &self.seen[(slots[i] * LABELS + k) * stride..][..stride];
            let middle = i8x16::new(lanes(row(RADIUS), first));
            let mut count = i8x16::splat(0);
            for (i, darker) in darker.iter().enumerate() {
                let row = row(i);
                for (dx, &darker) in darker.iter().enumerate() {
                    count -= middle.cmp_gt(i8x16::new(lanes(row, first + dx - RADIUS))) ^ darker;
                }
            }
            bytemuck::cast(count)
        })
    }
}

fn slot(y: usize) -> usize {
    y % ROWS
}

#[inline(always)]
fn lanes<T: Copy + Default>(row: &[T], at: usize) -> [T; LANES] {
    row.get(at..).and_then(|row| row.first_chunk()).copied().unwrap_or_default()
}

impl Search<'_> {
    /// The motions of a row, in pixels of the search per label.
    fn motions(&self, y: usize, out: &mut [Motion]) {
        let (scale, field) = (self.scale, self.field);
        // Blocks are looked up at one of their pixels, which is not quite the middle.
        let shift = (scale / 2) as f32;
        let inverse = 1.0 / scale as f32;
        for (x, out) in out.iter_mut().enumerate() {
            let motion = field.motion(x, y, scale);
            out.place = motion.place.map(|p| (p - shift) * inverse);
            out.direction = motion.direction.map(|d| d * (self.step * inverse));
        }
    }
}
