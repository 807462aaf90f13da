//! The search from small images to full size: each level searches around the corrections of the coarser one.

use super::census::{HALF, LABELS, Search};
use super::consistency::{INSIDE, Map, consistent, reliable};
use super::epipolar_line::EpipolarLines;
use super::extrapolation::extrapolated;
use super::gray::{Gray, MARGIN};
use super::semi_global::aggregate;
use super::subpixel::{SPAN, refine_subpixel};
use crate::image::{filled, marked, reserve, zeroed};
use crate::observer::{Observer, report};
use crate::upsampling::neighbours;
use crate::{ImageView, InverseDepth, Mask, Result, Stage};

/// Images are not made smaller than this, in pixels: fewer leave hardly any texture around a census window.
const SMALLEST: usize = 32;
/// Photos of more pixels are searched at half their size at most, to bound time and memory: there, the last level gains
/// little. Neither does it with a weak prior, as only a smooth surface is made of what is found.
const MOST: usize = 6_000_000;
/// Of the pixels inside the other photo one in so many has to be reliable for the others to keep their matches. Tuned on the
/// evaluation cases: flat between 5 and 10.
const FEW: usize = 5;
/// Share of the diagonal over which corrections fade into the prior where nothing is known. Tuned on the evaluation cases:
/// PSNR, coverage and bending are flat between 0.025 and 0.1.
const FADING: f32 = 0.05;

/// One photo, and the correction of its map. Corrections are in pixels along the epipolar line.
pub(super) struct Side<'a> {
    lines: EpipolarLines<'a>,
    /// The photo, then halves.
    pyramid: Vec<Gray>,
    /// Corrections at the level that was searched last.
    shifts: Vec<f32>,
    /// Where they are reliable.
    reliable: Vec<u8>,
    /// The corrected inverse depth.
    depth: Vec<f32>,
}

/// A refined map, and where it is reliable.
pub(super) struct Corrected {
    pub depth: InverseDepth,
    pub reliable: Mask,
}

/// What is searched, and how much the prior counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchOptions {
    /// Farthest from the prior, in pixels along the epipolar line.
    pub range: f32,
    /// Cost of any label but the prior's own.
    pub leaving_cost: u8,
    /// Whether matches are kept wherever there are some, even if they fail the left–right check.
    pub weak_prior: bool,
    /// Whether nothing is wanted of pixels that are not reliable.
    pub reliable_only: bool,
    /// Pixels along the epipolar line per label at full size.
    pub finest: f32,
}

/// Corrects the maps of both photos.
pub(super) fn coarse_to_fine(
    mut sides: [Side<'_>; 2],
    options: SearchOptions,
    observer: &mut dyn Observer,
) -> Result<[Corrected; 2]> {
    // The finest level that is searched: the full size, or half of it.
    let last = usize::from(options.weak_prior || sides.iter().any(|side| side.pixels() > MOST));
    build_pyramids(&mut sides, last, options.range)?;
    let levels = sides[0].pyramid.len();
    let last = last.min(levels - 1);
    // Of the work, of one side: all levels and both sides make up 1 at most.
    let share = |level: usize| 0.375 / (1u64 << (2 * (level - last))) as f32;
    let mut done = 0.0;
    for level in (last..levels).rev() {
        let step = if level == last { options.finest } else { 1.0 } * (1 << level) as f32;
        let part = share(level);
        search(&mut sides, level, step, options, &mut |side, fraction| {
            report(observer, Stage::Refine, done + (side as f32 + fraction) * part)
        })?;
        done += 2.0 * part;
        let marks = check(&mut sides, level)?;
        if level > last || !options.reliable_only {
            let keep_matches = options.weak_prior || level == last && options.leaving_cost == 0;
            extrapolate(&mut sides, level, marks, keep_matches)?;
        }
    }
    for i in 0..2 {
        report(observer, Stage::Refine, done)?;
        sides[i].shifts = subpixel_shifts(&mut sides, i, last, options)?;
    }
    sides.iter_mut().try_for_each(|side| side.finish(last, options.reliable_only))?;
    Ok(sides.map(|side| {
        let (width, height) = side.lines.prior.size();
        let reliable = Mask::from_bytes(side.reliable, width, height);
        Corrected { depth: InverseDepth::from_values(side.depth, width, height), reliable }
    }))
}

/// Adds levels until `last` is there and the labels of the coarsest reach `range`, or the images get too small.
fn build_pyramids(sides: &mut [Side<'_>; 2], last: usize, range: f32) -> Result<()> {
    let small = |sides: &[Side<'_>; 2]| {
        sides.iter().any(|side| side.pyramid.last().is_none_or(|g| g.width.min(g.height) < 2 * SMALLEST))
    };
    while (sides[0].pyramid.len() <= last || range > (HALF << (sides[0].pyramid.len() - 1)) as f32) && !small(sides) {
        sides.iter_mut().try_for_each(Side::add_level)?;
    }
    Ok(())
}

/// Searches both photos at `level`, `step` pixels per label, around the corrections of the level above.
fn search(
    sides: &mut [Side<'_>; 2],
    level: usize,
    step: f32,
    SearchOptions { range, leaving_cost, .. }: SearchOptions,
    progress: &mut dyn FnMut(usize, f32) -> Result<()>,
) -> Result<()> {
    let scale = 1 << level;
    let mut found: [Vec<f32>; 2] = Default::default();
    for (i, found) in found.iter_mut().enumerate() {
        let (own, other) = (&sides[i], &sides[1 - i]);
        let middle = labels(&own.shifts_at(level, None)?, step)?;
        let (from, to, lines) = (&own.pyramid[level], &other.pyramid[level], &own.lines);
        let search = Search { from, to, lines, scale, step, middle: &middle, range, leaving_cost, every: 1 };
        *found = aggregate(&search, &mut |fraction| progress(i, fraction))?;
    }
    sides.iter_mut().zip(found).try_for_each(|(side, found)| side.correct(level, found))
}

/// The labels nearest to shifts.
fn labels(shifts: &[f32], step: f32) -> Result<Vec<i16>> {
    let mut labels = zeroed(shifts.len())?;
    for (label, shift) in labels.iter_mut().zip(shifts) {
        *label = (shift / step + 0.5).floor() as i16;
    }
    Ok(labels)
}

/// Marks pixels by the left–right check, and as reliable those that pass it among enough others.
fn check(sides: &mut [Side<'_>; 2], level: usize) -> Result<[Vec<u8>; 2]> {
    let scale = 1 << level;
    let [a, b] = [&sides[0], &sides[1]].map(|side| Map {
        depth: &side.depth,
        scale,
        model: side.lines.model,
        photo: &side.pyramid[level],
    });
    let marks = [consistent(&a, &b)?, consistent(&b, &a)?];
    for (side, marks) in sides.iter_mut().zip(&marks) {
        let Gray { width, height, .. } = side.pyramid[level];
        side.reliable = reliable(marks, width, height)?;
    }
    Ok(marks)
}

/// Extrapolates the corrections of reliable pixels to all others. With `keep_matches`, and unless few are reliable, pixels inside the
/// other photo keep what was found.
fn extrapolate(sides: &mut [Side<'_>; 2], level: usize, marks: [Vec<u8>; 2], keep_matches: bool) -> Result<()> {
    for (side, marks) in sides.iter_mut().zip(marks) {
        let Gray { width, height, .. } = side.pyramid[level];
        let [w, h] = [width, height].map(|side| side as u64);
        let reach = FADING * ((w * w + h * h) as f32).sqrt();
        let smooth = extrapolated(&side.lines, &side.shifts, &side.reliable, (width, height, 1 << level), reach)?;
        let keep = keep_matches && marked(&side.reliable) * FEW > marked(&marks);
        let corrected = side.shifts.iter_mut().zip(&mut side.depth);
        for (((shift, depth), smooth), &mark) in corrected.zip(smooth).zip(&marks) {
            if *shift != smooth && !(keep && mark >= INSIDE) {
                (*shift, *depth) = (smooth, f32::NAN);
            }
        }
        side.update_depth(level);
    }
    Ok(())
}

/// The corrections of side `i` at `level`, which it gives away, refined to a fraction of a pixel.
fn subpixel_shifts(
    sides: &mut [Side<'_>; 2],
    i: usize,
    level: usize,
    SearchOptions { range, leaving_cost, .. }: SearchOptions,
) -> Result<Vec<f32>> {
    let mut shifts = std::mem::take(&mut sides[i].shifts);
    let scale = 1 << level;
    let step = SPAN / (LABELS - 1) as f32 * scale as f32;
    let middle = labels(&shifts, step)?;
    let (own, other) = (&sides[i], &sides[1 - i]);
    let (from, to, lines) = (&own.pyramid[level], &other.pyramid[level], &own.lines);
    let search = Search { from, to, lines, scale, step, middle: &middle, range, leaving_cost, every: LABELS - 1 };
    refine_subpixel(&search, &mut shifts, &own.reliable)?;
    Ok(shifts)
}

impl<'a> Side<'a> {
    pub fn new(lines: EpipolarLines<'a>, image: &ImageView<'_>) -> Result<Self> {
        let pyramid = vec![Gray::new(image)?];
        Ok(Self { lines, pyramid, shifts: Vec::new(), reliable: Vec::new(), depth: Vec::new() })
    }

    fn add_level(&mut self) -> Result<()> {
        let half = self.pyramid.last().map(Gray::half).transpose()?;
        self.pyramid.extend(half);
        Ok(())
    }

    fn pixels(&self) -> usize {
        self.pyramid.first().map_or(0, |photo| photo.width * photo.height)
    }

    /// The corrections of the level above, upsampled to `level`: of the four nearest pixels that of the one with the most
    /// similar gray value. 0 when that level was not searched, and of pixels that are not `wanted`.
    fn shifts_at(&self, level: usize, wanted: Option<&[u8]>) -> Result<Vec<f32>> {
        let own = &self.pyramid[level];
        let mut shifts = zeroed(own.width * own.height)?;
        let above = match self.pyramid.get(level + 1) {
            Some(above) if self.shifts.len() == above.width * above.height => above,
            _ => return Ok(shifts),
        };
        for (y, out) in shifts.chunks_exact_mut(own.width).enumerate() {
            let rows = neighbours(y, above.height).map(|v| {
                (&above.row(v as isize)[MARGIN..][..above.width], &self.shifts[v * above.width..][..above.width])
            });
            let wanted = wanted.map(|wanted| &wanted[y * own.width..]);
            for (x, (out, value)) in out.iter_mut().zip(&own.row(y as isize)[MARGIN..]).enumerate() {
                if wanted.is_some_and(|wanted| wanted[x] == 0) {
                    continue;
                }
                let columns = neighbours(x, above.width);
                // The difference, and two levels for each step from the nearest pixel; of equal ones the first.
                let rank = |i: usize| {
                    let difference = usize::from(rows[i / 2].0[columns[i % 2]].abs_diff(*value));
                    4 * (difference + 2 * (i / 2 + i % 2)) + i
                };
                let best = (0..4).fold(usize::MAX, |best, i| best.min(rank(i))) % 4;
                *out = rows[best / 2].1[columns[best % 2]];
            }
        }
        Ok(shifts)
    }

    /// Sets the corrections, those of `level`, and the inverse depth they make.
    fn correct(&mut self, level: usize, shifts: Vec<f32>) -> Result<()> {
        // Freed before the next one is made.
        self.depth = Vec::new();
        self.depth = filled(shifts.len(), f32::NAN)?;
        self.shifts = shifts;
        self.update_depth(level);
        Ok(())
    }

    /// Makes the inverse depth of the corrections at `level`, where there is none yet.
    fn update_depth(&mut self, level: usize) {
        let width = self.pyramid[level].width;
        for (y, (out, shifts)) in self.depth.chunks_exact_mut(width).zip(self.shifts.chunks_exact(width)).enumerate() {
            for (x, (out, &shift)) in out.iter_mut().zip(shifts).enumerate().filter(|(_, (out, _))| out.is_nan()) {
                *out = self.lines.depth_at(x, y, 1 << level, shift);
            }
        }
    }

    /// Takes corrections and reliable pixels of level `last`, which is the first or the second, to the full size, and leaves nothing but the
    /// depth and the marks. With `reliable_only` depth is 0 elsewhere.
    fn finish(&mut self, last: usize, reliable_only: bool) -> Result<()> {
        if last > 0 {
            let (photo, half) = (&self.pyramid[0], &self.pyramid[1]);
            let mut reliable = zeroed(photo.width * photo.height)?;
            for (y, row) in reliable.chunks_exact_mut(photo.width).enumerate() {
                let halves = &self.reliable[y / 2 * half.width..];
                row.iter_mut().enumerate().for_each(|(x, reliable)| *reliable = halves[x / 2]);
            }
            self.shifts = self.shifts_at(0, reliable_only.then_some(&reliable))?;
            self.reliable = reliable;
        }
        let wanted = |reliable: &u8| if reliable_only && *reliable == 0 { 0.0 } else { f32::NAN };
        self.depth = Vec::new();
        reserve(&mut self.depth, self.shifts.len())?;
        self.depth.extend(self.reliable.iter().map(wanted));
        self.update_depth(0);
        (self.shifts, self.pyramid) = Default::default();
        Ok(())
    }
}
