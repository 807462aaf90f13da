//! Semi-global aggregation (Hirschmüller 2008): costs are summed along eight paths on which labels change little.

use wide::{u8x16, u16x8};

use super::cost::{CostRows, Costs, HALF, LABELS, Search};
use super::gray::MARGIN;
use crate::Result;
use crate::image::{reserve, zeroed};

/// Rows that are finished together. Costs are kept for these and for [`AHEAD`] more, from which the paths that come
/// from below start.
const BAND: usize = 128;
const AHEAD: usize = 16;

/// Penalty for a change by one label.
const SMALL: u8 = 5;
/// Penalty for any larger change where brightness is even; it falls to half over ten grey levels.
const LARGE: f32 = 20.0;

/// Bytes per pixel in a row of path costs: 16 labels, then 16 that are out of reach.
const CELL: usize = 32;

/// Path costs of a row, each pixel's least taken off.
struct PathRow(Vec<u8>);

impl PathRow {
    fn new(width: usize) -> Result<Self> {
        let mut row = Vec::new();
        reserve(&mut row, CELL * width + CELL)?;
        row.resize(CELL * width + CELL, 0);
        let mut row = Self(row);
        row.clear();
        Ok(row)
    }

    /// As before the first row: everything is as good.
    fn clear(&mut self) {
        self.0.fill(u8::MAX);
        self.0[CELL - 16..].chunks_exact_mut(CELL).for_each(|cell| cell[..16].fill(0));
    }

    /// 16 labels of pixel `x` from label `shift` on.
    #[inline(always)]
    fn load(&self, x: usize, shift: isize) -> u8x16 {
        let at = (CELL - 16 + CELL * x).wrapping_add_signed(shift);
        u8x16::new(self.0.get(at..).and_then(|row| row.first_chunk::<16>()).copied().unwrap_or([u8::MAX; 16]))
    }

    #[inline(always)]
    fn store(&mut self, x: usize, value: u8x16) {
        let at = CELL - 16 + CELL * x;
        if let Some(cell) = self.0.get_mut(at..at + 16) {
            cell.copy_from_slice(&value.to_array());
        }
    }
}

/// One of the two directions in which rows are passed.
struct Pass {
    before: [PathRow; 3],
    now: [PathRow; 3],
}

/// The best label of each pixel, to a fraction, as pixels of motion away from the prior.
pub(super) fn aggregate(search: &Search<'_>, progress: &mut dyn FnMut(f32) -> Result<()>) -> Result<Vec<f32>> {
    let (w, h) = (search.from.width, search.from.height);
    let penalties: [u8; 256] =
        std::array::from_fn(|difference| (LARGE / (1.0 + difference as f32 / 10.0)).max(1.5 * f32::from(SMALL)) as u8);
    let rows = h.min(BAND + AHEAD);
    let mut costs: Vec<Costs> = zeroed(rows * w)?;
    let mut sums: Vec<[u8x16; 2]> = Vec::new();
    reserve(&mut sums, h.min(BAND) * w)?;
    sums.resize(h.min(BAND) * w, [u8x16::splat(0); 2]);
    let mut from_below = vec![[u8x16::splat(0); 2]; w];
    let mut best: Vec<f32> = zeroed(w * h)?;
    let mut source = CostRows::new(search)?;
    let (mut down, mut up) = (Pass::new(w)?, Pass::new(w)?);
    let mut made = 0;
    for first in (0..h).step_by(BAND) {
        progress(first as f32 / h as f32)?;
        let (last, end) = ((first + BAND).min(h), (first + BAND + AHEAD).min(h));
        // What was ahead of the band before is in this one.
        if first > 0 {
            costs.copy_within(BAND * w..rows * w, 0);
        }
        for y in made..end {
            source.next(&mut costs[(y - first) * w..][..w]);
        }
        made = end;
        for y in first..last {
            let sums = &mut sums[(y - first) * w..][..w];
            down.row(search, &costs[(y - first) * w..][..w], y, false, &penalties, sums);
        }
        up.clear();
        for y in (first..end).rev() {
            up.row(search, &costs[(y - first) * w..][..w], y, true, &penalties, &mut from_below);
            if y < last {
                let both = sums[(y - first) * w..].iter().zip(&from_below);
                let middle = &search.middle[y * w..];
                for ((best, (above, below)), &middle) in best[y * w..].iter_mut().zip(both).zip(middle) {
                    *best = (f32::from(middle) + winner([above[0], above[1], below[0], below[1]])) * search.step;
                }
            }
        }
    }
    Ok(best)
}

impl Pass {
    fn new(width: usize) -> Result<Self> {
        let row = || PathRow::new(width);
        Ok(Self { before: [row()?, row()?, row()?], now: [row()?, row()?, row()?] })
    }

    fn clear(&mut self) {
        self.before.iter_mut().for_each(PathRow::clear);
    }

    /// Extends four paths by a row: from the pixel beside and from the three of the row before. `sums` gets the sums of
    /// two paths each.
    #[inline(never)]
    fn row(
        &mut self,
        search: &Search<'_>,
        costs: &[Costs],
        y: usize,
        backwards: bool,
        penalties: &[u8; 256],
        sums: &mut [[u8x16; 2]],
    ) {
        let (w, h) = (search.from.width, search.from.height);
        let before_y = if backwards { (y + 1).min(h - 1) } else { y.saturating_sub(1) };
        let gray = |y: usize| &search.from.row(y as isize)[MARGIN..][..w];
        let middle = |y: usize| &search.middle[y * w..][..w];
        let (gray, gray_before, middle, middle_before) = (gray(y), gray(before_y), middle(y), middle(before_y));
        let small = u8x16::splat(SMALL);
        let mut beside = 0u128;
        let mut x_beside = None::<usize>;
        let order = |i: usize| if backwards { w - 1 - i } else { i };
        for i in 0..w {
            let x = order(i);
            let cost = costs[x];
            let (value, own) = (gray[x], isize::from(middle[x]));
            let (shift, penalty) = match x_beside {
                Some(q) => (own - isize::from(middle[q]), penalties[gray[q].abs_diff(value) as usize]),
                None => (0, penalties[0]),
            };
            let previous = shifted(beside, shift);
            let next = extended(
                cost,
                bytemuck::cast(previous),
                bytemuck::cast(previous << 8 | 0xff),
                bytemuck::cast(previous >> 8 | 0xff << 120),
                small,
                u8x16::splat(penalty),
            );
            beside = bytemuck::cast(next);
            x_beside = Some(x);
            let mut paths = [next; 4];
            for (d, (before, now)) in self.before.iter().zip(&mut self.now).enumerate() {
                // 0, 1 and 2: from the side that was passed, straight, from the side to come.
                let q = match d {
                    1 => Some(x),
                    0 => i.checked_sub(1).map(order),
                    _ => (i + 1 < w).then(|| order(i + 1)),
                };
                let next = match q {
                    Some(q) => {
                        let shift = own - isize::from(middle_before[q]);
                        let penalty = penalties[gray_before[q].abs_diff(value) as usize];
                        let load =
                            |k: isize| if shift.abs() < 15 { before.load(q, shift + k) } else { u8x16::splat(u8::MAX) };
                        extended(cost, load(0), load(-1), load(1), small, u8x16::splat(penalty))
                    }
                    None => extended(
                        cost,
                        u8x16::splat(0),
                        u8x16::splat(0),
                        u8x16::splat(0),
                        small,
                        u8x16::splat(penalties[0]),
                    ),
                };
                now.store(x, next);
                paths[d + 1] = next;
            }
            sums[x] = [paths[0].saturating_add(paths[1]), paths[2].saturating_add(paths[3])];
        }
        std::mem::swap(&mut self.before, &mut self.now);
    }
}

/// Labels counted from `shift` on; those out of reach are 255.
#[inline(always)]
fn shifted(labels: u128, shift: isize) -> u128 {
    match shift {
        0 => labels,
        1..16 => labels >> (8 * shift) | !(u128::MAX >> (8 * shift)),
        -15..0 => labels << (-8 * shift) | !(u128::MAX << (-8 * shift)),
        _ => u128::MAX,
    }
}

/// One step along a path: the cost and the least of staying at the label, changing it by one and changing it by more;
/// less the least of all labels.
#[inline(always)]
fn extended(cost: u8x16, same: u8x16, lower: u8x16, higher: u8x16, small: u8x16, large: u8x16) -> u8x16 {
    let next = cost.saturating_add(same.min(lower.min(higher).saturating_add(small)).min(large));
    let mut least = next;
    for _ in 0..4 {
        least = u8x16::unpack_low(least, least).min(u8x16::unpack_high(least, least));
    }
    next.saturating_sub(least)
}

/// Labels in the order in which they win when sums are the same: the middle one first.
const ORDER: [u16; 16] = {
    let (mut order, mut k) = ([15; 16], 0);
    while k < LABELS {
        let away = k as i32 - HALF;
        order[k] = if away > 0 { 2 * away } else { -2 * away - (away < 0) as i32 } as u16;
        k += 1;
    }
    order
};

/// The label of the least sum, to a fraction by a parabola, counted from the middle one.
#[inline(always)]
fn winner(pairs: [u8x16; 4]) -> f32 {
    let zero = u8x16::splat(0);
    let low = pairs.map(|p| bytemuck::cast::<_, u16x8>(u8x16::unpack_low(p, zero)));
    let high = pairs.map(|p| bytemuck::cast::<_, u16x8>(u8x16::unpack_high(p, zero)));
    let sums: [u16x8; 2] = [low, high].map(|[a, b, c, d]| a + b + c + d);
    let [low, high]: [u16x8; 2] = bytemuck::cast(ORDER);
    // At most 4·255·16, and the order below it: all fits.
    let ranked = ((sums[0] << 4_i32) | low).min((sums[1] << 4_i32) | high);
    let order = ranked.to_array().into_iter().fold(u16::MAX, u16::min) & 15;
    let away = if order % 2 == 0 { i32::from(order / 2) } else { -i32::from(order / 2) - 1 };
    let sums: [u16; 16] = bytemuck::cast(sums);
    let sum = |k: i32| f32::from(sums[(k + HALF) as usize & 15]);
    if away.abs() == HALF {
        return away as f32;
    }
    let (l, m, r) = (sum(away - 1), sum(away), sum(away + 1));
    away as f32 + ((l - r) / (2.0 * (l - 2.0 * m + r)).max(1.0)).clamp(-0.5, 0.5)
}
