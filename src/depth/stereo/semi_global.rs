//! Semi-global aggregation (Hirschmüller 2008): costs are summed along eight paths on which labels change little.

use wide::{i8x16, i32x4, u8x16, u16x8, u64x2};

use super::census::{CostRows, Costs, HALF, LABELS, Search};
use super::gray::MARGIN;
use crate::Result;
use crate::image::zeroed;

/// Rows that are finished together. Costs are kept for these and for [`AHEAD`] more, from which the paths that come
/// from below start.
const BAND: usize = 128;
const AHEAD: usize = 16;

/// Penalty for a change by one label (P1 in the reference). Tuned on the evaluation cases: 2 and 10 cost 6 % and 14 % more
/// visible steps.
const SMALL: u8 = 5;
/// Penalty for any larger change (P2) where brightness is even; it falls to half over ten gray levels. Tuned on
/// the evaluation cases: PSNR, coverage and visible steps are flat between 20 and 40.
const LARGE: f32 = 20.0;

/// Path costs of a row for three paths, each pixel's least taken off: bytes that begin with the costs of what is beyond the
/// border; then for each pixel 16 labels, and as many that are out of reach before and after them.
struct PathRow(Vec<u8>);

/// Bytes per pixel, and from the start to the labels of the first.
const CELL: usize = 32;
const FIRST: usize = 80;
/// Where the labels beyond the border are: from 16 before to 16 after these all are as good.
const BORDER: usize = 24;
/// From this shift on no label is in reach.
const REACH: u32 = 15;

impl PathRow {
    fn new(width: usize) -> Result<[Self; 3]> {
        let row = || zeroed(FIRST + CELL * width).map(Self);
        let mut rows = [row()?, row()?, row()?];
        rows.iter_mut().for_each(Self::clear);
        Ok(rows)
    }

    /// As before the first row: everything is as good.
    fn clear(&mut self) {
        for cell in self.0[FIRST - 16..].chunks_mut(CELL) {
            let (beyond, labels) = cell.split_at_mut(16);
            beyond.fill(u8::MAX);
            labels.fill(0);
        }
    }

    /// The labels of the cell at `at`, those one below and those one above, all from label `shift` on.
    #[inline(always)]
    fn load(&self, at: usize, shift: i32) -> [u8x16; 3] {
        let from = if shift.unsigned_abs() < REACH { at.wrapping_add_signed(shift as isize - 1) } else { self.0.len() };
        match self.0.get(from..).and_then(<[u8]>::first_chunk::<18>) {
            Some(labels) => [1, 0, 2].map(|from| u8x16::new(labels[from..].first_chunk().copied().unwrap_or_default())),
            None => [u8x16::splat(u8::MAX); 3],
        }
    }

    #[inline(always)]
    fn store(&mut self, x: usize, value: u8x16) {
        let at = FIRST + CELL * x;
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

/// The best label of each pixel, to a fraction, as distance from the prior in pixels along the epipolar line.
pub(super) fn aggregate(search: &Search<'_>, progress: &mut dyn FnMut(f32) -> Result<()>) -> Result<Vec<f32>> {
    let (w, h) = (search.from.width, search.from.height);
    let penalties: [u8; 256] =
        std::array::from_fn(|difference| (LARGE / (1.0 + difference as f32 / 10.0)).max(1.5 * f32::from(SMALL)) as u8);
    let rows = h.min(BAND + AHEAD);
    let mut costs: Vec<Costs> = zeroed(rows * w)?;
    let mut sums: Vec<[u8x16; 2]> = zeroed(h.min(BAND) * w)?;
    let mut from_below: Vec<[u8x16; 2]> = zeroed(w)?;
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
                decide(search, y, &sums[(y - first) * w..], &from_below, &mut best[y * w..]);
            }
        }
    }
    Ok(best)
}

impl Pass {
    fn new(width: usize) -> Result<Self> {
        Ok(Self { before: PathRow::new(width)?, now: PathRow::new(width)? })
    }

    fn clear(&mut self) {
        self.before.iter_mut().for_each(PathRow::clear);
    }

    /// Extends four paths by a row: from the pixel beside and from the three of the row before. `sums` gets the sums of
    /// two paths each.
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
        let (costs, sums) = (&costs[..w], &mut sums[..w]);
        let order = |i: usize| if backwards { (w - 1).wrapping_sub(i) } else { i };
        // Where the labels of a pixel of the row before are, its middle label and its brightness.
        let look = |i: usize| {
            let x = order(i);
            if x < w { (FIRST + CELL * x, i32::from(middle_before[x]), gray_before[x]) } else { (BORDER, 0, 0) }
        };
        let mut beside = u8x16::splat(0);
        let mut beside_at = None;
        // Of the row before, on the side that was passed, straight, and on the side to come.
        let (mut behind, mut straight) = ((BORDER, 0, 0), (BORDER, 0, 0));
        let ([before_0, before_1, before_2], [now_0, now_1, now_2]) = (&self.before, &mut self.now);
        for i in 0..=w {
            let ahead = look(i);
            // The one before, now that the one after it is known.
            let x = order(i.wrapping_sub(1));
            if x < w {
                let (cost, value, own) = (costs[x], gray[x], i32::from(middle[x]));
                let penalty = |gray: u8| u8x16::splat(penalties[gray.abs_diff(value) as usize]);
                let (middle, gray) = beside_at.unwrap_or((own, value));
                beside_at = Some((own, value));
                let same = shifted(beside, own - middle);
                let bits: u128 = bytemuck::cast(same);
                let [lower, higher] = [bits << 8 | 0xff, bits >> 8 | 0xff << 120].map(bytemuck::cast);
                let step =
                    |before: &PathRow, (at, middle, gray)| extended(cost, before.load(at, own - middle), penalty(gray));
                let [a, b, c, d] = lowered([
                    extended(cost, [same, lower, higher], penalty(gray)),
                    step(before_0, behind),
                    step(before_1, straight),
                    step(before_2, ahead),
                ]);
                beside = a;
                now_0.store(x, b);
                now_1.store(x, c);
                now_2.store(x, d);
                sums[x] = [a.saturating_add(b), c.saturating_add(d)];
            }
            (behind, straight) = (straight, ahead);
        }
        std::mem::swap(&mut self.before, &mut self.now);
    }
}

/// Labels counted from `shift` on; those out of reach are 255.
#[inline(always)]
fn shifted(labels: u8x16, shift: i32) -> u8x16 {
    const PLACES: i8x16 = i8x16::new([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    if shift == 0 {
        return labels;
    }
    let from = PLACES + i8x16::splat(shift.clamp(-16, 16) as i8);
    // What is out of reach becomes 0.
    let left: i8x16 = bytemuck::cast(!labels);
    bytemuck::cast(!left.swizzle(from))
}

/// One step along a path: the cost and the least of staying at the label, changing it by one and changing it by more.
#[inline(always)]
fn extended(cost: u8x16, [same, lower, higher]: [u8x16; 3], large: u8x16) -> u8x16 {
    cost.saturating_add(same.min(lower.min(higher).saturating_add(u8x16::splat(SMALL))).min(large))
}

/// Four paths, each less the least of its labels.
#[inline(always)]
fn lowered(paths: [u8x16; 4]) -> [u8x16; 4] {
    let least = |a, b| u8x16::unpack_low(a, b).min(u8x16::unpack_high(a, b));
    let [a, b, c, d] = paths;
    // In turns those of a, c, b and d; then four of each.
    let all = least(least(a, b), least(c, d));
    let all = least(all, all);
    let [ta, tc, tb, td]: [i32; 4] = bytemuck::cast(least(all, all));
    let lower = |path: u8x16, least: i32| path.saturating_sub(bytemuck::cast(i32x4::splat(least)));
    [lower(a, ta), lower(b, tb), lower(c, tc), lower(d, td)]
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

/// The best labels of row `y`, as pixels along the epipolar line, from the sums of the paths from above and from below.
#[inline(never)] // see `crate::rows`
fn decide(search: &Search<'_>, y: usize, above: &[[u8x16; 2]], below: &[[u8x16; 2]], best: &mut [f32]) {
    let middle = &search.middle[y * search.from.width..];
    for (((best, &middle), &[a, b]), &[c, d]) in best.iter_mut().zip(middle).zip(above).zip(below) {
        *best = (f32::from(middle) + winner([a, b, c, d])) * search.step;
    }
}

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
    let fold = |v: u16x8, bits: i32| v.min(bytemuck::cast(bytemuck::cast::<_, u64x2>(v) >> bits));
    let [a, b]: [u64; 2] = bytemuck::cast(fold(fold(ranked, 32), 16));
    let order = i32::from((a as u16).min(b as u16) & 15);
    let away = if order & 1 == 0 { order / 2 } else { -order / 2 - 1 };
    if away.abs() == HALF {
        return away as f32;
    }
    let sums: [u16; 16] = bytemuck::cast(sums);
    let sum = |k: i32| i32::from(sums[(k + HALF) as usize & 15]);
    let (l, m, r) = (sum(away - 1), sum(away), sum(away + 1));
    away as f32 + (l - r) as f32 / (2 * (l - 2 * m + r)).max(1) as f32
}
