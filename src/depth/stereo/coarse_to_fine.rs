//! The search from small pictures to full size.

use super::census::{HALF, LABELS, Search};
use super::consistency::{Map, consistent, solid};
use super::epipolar_line::Field;
use super::extrapolation::continued;
use super::gray::{Gray, MARGIN};
use super::semi_global::aggregate;
use super::subpixel::{SPAN, polish};
use crate::image::{marked, reserve, zeroed};
use crate::observer::{Observer, report};
use crate::{ImageView, InverseDepth, Mask, Result, Stage};

/// Pictures are not made smaller than this, in pixels.
const SMALLEST: usize = 32;
/// Photos of more pixels are searched at half their size at most: what is gained at full size is hardly seen.
const MOST: usize = 6_000_000;
/// Of the pixels that are seen in the other photo one in so many has to be trusted for the others to keep their matches.
const FEW: usize = 5;
/// Share of the diagonal over which corrections fade into the prior where nothing is known.
const FADING: f32 = 0.05;

/// One photo and its map to the other.
pub(super) struct Side<'a> {
    field: Field<'a>,
    /// The photo, then halves.
    pyramid: Vec<Gray>,
    /// Corrections at the level that was searched last, in pixels of motion.
    shifts: Vec<f32>,
    /// Where they are believed.
    trusted: Vec<u8>,
    /// The inverse depth they make.
    depth: Vec<f32>,
}

/// A refined map, and where it is believed.
pub(super) struct Found {
    pub depth: InverseDepth,
    pub trusted: Mask,
}

impl<'a> Side<'a> {
    pub fn new(field: Field<'a>, image: &ImageView<'_>) -> Result<Self> {
        let pyramid = vec![Gray::new(image)?];
        Ok(Self { field, pyramid, shifts: Vec::new(), trusted: Vec::new(), depth: Vec::new() })
    }

    fn add_level(&mut self) -> Result<()> {
        let half = self.pyramid.last().map(Gray::half).transpose()?;
        self.pyramid.extend(half);
        Ok(())
    }

    fn pixels(&self) -> usize {
        self.pyramid.first().map_or(0, |photo| photo.width * photo.height)
    }

    /// The corrections of the level above, one for each pixel of `level`: of the four nearest that of the pixel that looks
    /// most alike. 0 when that level was not searched.
    #[inline(never)]
    fn shifts_at(&self, level: usize) -> Result<Vec<f32>> {
        let own = &self.pyramid[level];
        let mut shifts = zeroed(own.width * own.height)?;
        let above = match self.pyramid.get(level + 1) {
            Some(above) if self.shifts.len() == above.width * above.height => above,
            _ => return Ok(shifts),
        };
        let near = |i: usize, side: usize| [i / 2, (i / 2 + (i & 1)).saturating_sub(1 - (i & 1)).min(side - 1)];
        for (y, out) in shifts.chunks_exact_mut(own.width).enumerate() {
            let rows = near(y, above.height).map(|v| {
                (&above.row(v as isize)[MARGIN..][..above.width], &self.shifts[v * above.width..][..above.width])
            });
            for (x, (out, value)) in out.iter_mut().zip(&own.row(y as isize)[MARGIN..]).enumerate() {
                let columns = near(x, above.width);
                // The difference, and of the same ones the first.
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

    /// Takes on corrections for `level`.
    fn correct(&mut self, level: usize, shifts: Vec<f32>) -> Result<()> {
        self.depth = Vec::new();
        reserve(&mut self.depth, shifts.len())?;
        self.depth.resize(shifts.len(), f32::NAN);
        self.shifts = shifts;
        self.apply(level);
        Ok(())
    }

    /// Makes the inverse depth of the corrections at `level`, where there is none yet.
    #[inline(never)]
    fn apply(&mut self, level: usize) {
        let width = self.pyramid[level].width;
        for (y, (out, shifts)) in self.depth.chunks_exact_mut(width).zip(self.shifts.chunks_exact(width)).enumerate() {
            for (x, (out, &shift)) in out.iter_mut().zip(shifts).enumerate().filter(|(_, (out, _))| out.is_nan()) {
                *out = self.field.moved(x, y, 1 << level, shift);
            }
        }
    }
}

/// How far from the prior is searched.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Farthest, in pixels of motion.
    pub range: f32,
    /// Cost of leaving the prior at all.
    pub stay: u8,
    /// Whether the prior is but a guess.
    pub guess: bool,
    /// Pixels of motion per label at full size.
    pub finest: f32,
}

/// The labels nearest to shifts.
#[inline(never)]
fn labels(shifts: &[f32], step: f32) -> Result<Vec<i16>> {
    let mut labels = zeroed(shifts.len())?;
    for (label, shift) in labels.iter_mut().zip(shifts) {
        *label = (shift / step + 0.5).floor() as i16;
    }
    Ok(labels)
}

/// Corrects the maps of both photos.
pub(super) fn coarse_to_fine(
    mut sides: [Side<'_>; 2],
    Reach { range, stay, guess, finest }: Reach,
    observer: &mut dyn Observer,
) -> Result<[Found; 2]> {
    let small = |sides: &[Side<'_>; 2]| {
        sides.iter().any(|side| side.pyramid.last().is_none_or(|g| g.width.min(g.height) < 2 * SMALLEST))
    };
    let last = usize::from(sides.iter().any(|side| side.pixels() > MOST));
    while (sides[0].pyramid.len() <= last || range > (HALF << (sides[0].pyramid.len() - 1)) as f32) && !small(&sides) {
        sides.iter_mut().try_for_each(Side::add_level)?;
    }
    let levels = sides[0].pyramid.len();
    let last = last.min(levels - 1);
    // Of the work, of one side: all levels and both sides make up 1 at most.
    let share = |level: usize| 0.375 / (1u64 << (2 * (level - last))) as f32;
    let mut done = 0.0;
    for level in (last..levels).rev() {
        let scale = 1 << level;
        let step = if level == last { finest } else { 1.0 } * scale as f32;
        let mut found: [Vec<f32>; 2] = Default::default();
        for (found, [own, other]) in found.iter_mut().zip([[0, 1], [1, 0]].map(|pair| pair.map(|i| &sides[i]))) {
            let middle = labels(&own.shifts_at(level)?, step)?;
            let (from, to) = (&own.pyramid[level], &other.pyramid[level]);
            let search = Search { from, to, field: &own.field, scale, step, middle: &middle, range, stay, every: 1 };
            *found = aggregate(&search, &mut |part| report(observer, Stage::Refine, done + part * share(level)))?;
            done += share(level);
        }
        for (side, found) in sides.iter_mut().zip(found) {
            side.correct(level, found)?;
        }
        let [a, b] = [&sides[0], &sides[1]].map(|side| Map {
            depth: &side.depth,
            width: side.pyramid[level].width,
            scale,
            model: side.field.model,
        });
        let agree = [consistent(&a, &b)?, consistent(&b, &a)?];
        for (side, agree) in sides.iter_mut().zip(agree) {
            let Gray { width, height, .. } = side.pyramid[level];
            side.trusted = solid(&agree, width, height)?;
            let reach = FADING * ((width * width + height * height) as f32).sqrt();
            let smooth = continued(&side.field, &side.shifts, &side.trusted, (width, height, scale), reach)?;
            let keep = (guess || level == last && stay == 0) && marked(&side.trusted) * FEW > marked(&agree);
            let corrected = side.shifts.iter_mut().zip(&mut side.depth);
            for (((shift, depth), smooth), &mark) in corrected.zip(smooth).zip(&agree) {
                if *shift != smooth && !(keep && mark != 0) {
                    (*shift, *depth) = (smooth, f32::NAN);
                }
            }
            side.apply(level);
        }
    }
    for i in 0..2 {
        report(observer, Stage::Refine, done)?;
        let mut shifts = std::mem::take(&mut sides[i].shifts);
        let scale = 1 << last;
        let step = SPAN / (LABELS - 1) as f32 * scale as f32;
        let middle = labels(&shifts, step)?;
        let (own, other) = (&sides[i], &sides[1 - i]);
        let (from, to, field) = (&own.pyramid[last], &other.pyramid[last], &own.field);
        let search = Search { from, to, field, scale, step, middle: &middle, range, stay, every: LABELS - 1 };
        polish(&search, &mut shifts, &own.trusted)?;
        sides[i].correct(last, shifts)?;
    }
    if last > 0 {
        for side in &mut sides {
            side.correct(0, side.shifts_at(0)?)?;
            let (photo, half) = (&side.pyramid[0], &side.pyramid[1]);
            let mut trusted = zeroed(photo.width * photo.height)?;
            for (y, row) in trusted.chunks_exact_mut(photo.width).enumerate() {
                let halves = &side.trusted[y / 2 * half.width..];
                row.iter_mut().enumerate().for_each(|(x, trusted)| *trusted = halves[x / 2]);
            }
            side.trusted = trusted;
        }
    }
    Ok(sides.map(|side| {
        let (width, height) = (side.field.prior.width(), side.field.prior.height());
        let trusted = Mask::from_bytes(side.trusted, width, height);
        Found { depth: InverseDepth::from_values(side.depth, width, height), trusted }
    }))
}
