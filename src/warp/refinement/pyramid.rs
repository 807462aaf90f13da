//! The search from small pictures to full size.

use super::aggregate::aggregate;
use super::consistency::{consistent, solid};
use super::continuation::continued;
use super::cost::{HALF, Search};
use super::gray::{Gray, MARGIN};
use super::motion::Field;
use crate::image::{reserve, zeroed};
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
}

/// A refined map, and where it is believed.
pub(super) struct Found {
    pub depth: InverseDepth,
    pub trusted: Mask,
}

impl<'a> Side<'a> {
    pub fn new(field: Field<'a>, image: &ImageView<'_>) -> Result<Self> {
        Ok(Self { field, pyramid: vec![Gray::new(image)?], shifts: Vec::new(), trusted: Vec::new() })
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
    /// most alike. Nothing when that level was not searched.
    #[inline(never)]
    fn shifts_at(&self, level: usize) -> Result<Vec<f32>> {
        let mut shifts = Vec::new();
        let [own, above, ..] = &self.pyramid[level..] else { return Ok(shifts) };
        if self.shifts.len() != above.width * above.height {
            return Ok(shifts);
        }
        reserve(&mut shifts, own.width * own.height)?;
        let near = |i: usize, side: usize| [i / 2, (i / 2 + (i & 1)).saturating_sub(1 - (i & 1)).min(side - 1)];
        for i in 0..own.width * own.height {
            let (x, y) = (i % own.width, i / own.width);
            let value = own.row(y as isize)[MARGIN + x];
            let (mut least, mut best) = (u32::MAX, 0.0);
            for (dy, v) in near(y, above.height).into_iter().enumerate() {
                let row = above.row(v as isize);
                for (dx, u) in near(x, above.width).into_iter().enumerate() {
                    let difference = u32::from(row[MARGIN + u].abs_diff(value)) + 2 * (dx + dy) as u32;
                    if difference < least {
                        (least, best) = (difference, self.shifts[v * above.width + u]);
                    }
                }
            }
            shifts.push(best);
        }
        Ok(shifts)
    }

    fn finish(self) -> Result<Found> {
        let (width, height) = (self.field.prior.width(), self.field.prior.height());
        Ok(Found { depth: self.field.refined(&self.shifts)?, trusted: Mask { data: self.trusted, width, height } })
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
            let mut middle: Vec<i16> = zeroed(own.pyramid[level].width * own.pyramid[level].height)?;
            for (middle, shift) in middle.iter_mut().zip(own.shifts_at(level)?) {
                *middle = (shift / step + 0.5).floor() as i16;
            }
            let (from, to) = (&own.pyramid[level], &other.pyramid[level]);
            let search = Search { from, to, field: &own.field, scale, step, middle: &middle, range, stay };
            *found = aggregate(&search, &mut |part| report(observer, Stage::Refine, done + part * share(level)))?;
            done += share(level);
        }
        for (side, found) in sides.iter_mut().zip(found) {
            side.shifts = found;
        }
        let size = |side: &Side<'_>| (side.pyramid[level].width, side.pyramid[level].height, scale);
        let [a, b] = [&sides[0], &sides[1]];
        let maps = [a.field.map(&a.shifts, size(a))?, b.field.map(&b.shifts, size(b))?];
        let agree = [
            consistent(&maps[0], a.field.model, &maps[1], b.field.model)?,
            consistent(&maps[1], b.field.model, &maps[0], a.field.model)?,
        ];
        drop(maps);
        for (side, agree) in sides.iter_mut().zip(agree) {
            let size = size(side);
            let (width, height, _) = size;
            side.trusted = solid(&agree, width, height)?;
            let reach = FADING * ((width * width + height * height) as f32).sqrt();
            let smooth = continued(&side.field, &side.shifts, &side.trusted, size, reach)?;
            let count = |marks: &[u8]| marks.iter().filter(|&&mark| mark != 0).count();
            let keep = (guess || level == last && stay == 0) && count(&side.trusted) * FEW > count(&agree);
            for ((shift, smooth), &mark) in side.shifts.iter_mut().zip(smooth).zip(&agree) {
                if !(keep && mark != 0) {
                    *shift = smooth;
                }
            }
        }
    }
    if last > 0 {
        for side in &mut sides {
            side.shifts = side.shifts_at(0)?;
            let (photo, half) = (&side.pyramid[0], &side.pyramid[1]);
            let mut trusted = zeroed(photo.width * photo.height)?;
            for (y, row) in trusted.chunks_exact_mut(photo.width).enumerate() {
                let halves = &side.trusted[y / 2 * half.width..];
                row.iter_mut().enumerate().for_each(|(x, trusted)| *trusted = halves[x / 2]);
            }
            side.trusted = trusted;
        }
    }
    let [a, b] = sides;
    Ok([a.finish()?, b.finish()?])
}
