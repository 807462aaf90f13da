//! Cost of the seam at each pixel: how much the photos differ there in colour and gradient, and how strong an edge is there.

use std::ops::Range;

use wide::i32x4;

use super::detail::Detail;
use super::level::Level;
use super::{BOTH, COARSEST, Preference};
use crate::distance::{STRAIGHT, distance};
use crate::image::zeroed;
use crate::mosaic::canvas::Placed;
use crate::observer::{Observer, report_row};
use crate::rect::{bounding_box, diagonal, extent};
use crate::warp::RELIABLE;
use crate::{Image, Mask, Result, Stage};

/// Half the side in pixels of the window whose mean differences in colour are looked at: what is seen of a step.
const RADIUS: usize = 2;
/// Rows that are needed at once.
const ROWS: usize = 2 * RADIUS + 1;
/// Seam cost per level of that difference. Tuned on the evaluation cases: flat between 4 and 8, at 16 steps are 4 % fewer.
const STEP: i32 = 8;
/// A difference of so many levels costs twice as much, so that the seam rather goes a long way round an object than a short one
/// through it. Tuned on 13 real pairs, both ways round: flat from 8 to 32.
const OBJECT: i32 = 16;
/// Cost per level of the reference's own contrast: the smallest misalignment frays an edge that the seam runs along or across. Visible steps of 13
/// pairs of real photos are .041, .037, .030 and .029 with 0, 1, 2 and 4, of ten sets .060, .048, .044 and .040.
const CONTRAST: i32 = 2;
/// Additional cost of a pixel that the refinement found unreliable.
const UNRELIABLE: i32 = 40;
/// Data cost of the target at a pixel of confidence 0 that looks nothing like the reference. With 96 and less the seam
/// of the gallery shows smeared cells rather than cross a column.
const DATA_COST: i32 = 128;
/// Data cost of the target at a pixel that looks nothing like the reference, which is shown undistorted; one that looks half like it costs a
/// quarter. In a mosaic of many only one photo is undistorted: where covering the others costs as much, a door leaf in one of ten sets is
/// torn. Tuned by eye on 33 real pairs; flat between 48 and 112 on 13 of them. With 16 a target that covers the whole reference hides it,
/// however bent it is.
const DISTORTED: i32 = 48;
/// Share of the diagonal along the reference's border where that costs nothing, and over which it then grows: a seam at the very border
/// leaves nothing to align.
const BORDER: f64 = 0.06;
/// Mean differences, over three channels, from which on two pixels look nothing like each other. Tuned on the evaluation
/// cases: flat between 32 and 64, at 128 there are 6 % more visible steps.
const UNLIKE: i32 = 64;

/// The level of the canvas' pixels around where both photos are valid; `None` where they nowhere are.
pub(super) fn finest(
    image: &Image,
    reference: &Placed<'_>,
    preference: &Preference<'_>,
    seam: &Mask,
    observer: &mut dyn Observer,
) -> Result<Option<Level>> {
    let free = seam.data().iter().filter(|&&side| side == BOTH).count();
    // Two cells of the coarsest grid around what is to be decided: the cut is between what lies there.
    let margin = 2 << (free / COARSEST).max(1).ilog2().div_ceil(2);
    let size = seam.size();
    let overlap =
        |y: usize| extent(seam.data()[y * seam.width()..(y + 1) * seam.width()].iter().map(|&side| side == BOTH));
    let Some(overlap) = bounding_box(size.1, &overlap) else { return Ok(None) };
    let (columns, rows) = overlap.grown(margin, size).ranges();
    let mut level = Level::empty(columns.start, rows.start, columns.len(), rows.len())?;
    let photo = reference.photo.size();
    let border = ((BORDER * diagonal(photo) * f64::from(STRAIGHT)) as u32).max(1);
    let mosaic = match preference.labels {
        Some((labels, undistorted)) => {
            let detail = Detail::of(image, reference, seam, labels)?;
            // All but one of its photos may be distorted themselves.
            let inside = distance(labels.data().len(), photo.0, &|at| labels.data()[at] != undistorted)?;
            Some((labels, detail, inside))
        }
        None => None,
    };
    // The frame of a mosaic says nothing of the border of its undistorted photo.
    let own = if mosaic.is_none() { Some(reference.border_distance(size)?) } else { None };
    let mut differences = Differences::new(image, reference, seam, columns.clone())?;
    for (j, cells) in level.cells.chunks_exact_mut(columns.len()).enumerate() {
        let y = rows.start + j;
        report_row(observer, Stage::Blend, j, rows.len())?;
        differences.advance(y, rows.clone());
        let mut around = differences.around(0);
        let at = y * seam.width() + columns.start;
        let sides = &seam.data()[at..at + columns.len()];
        let photo_rows = [y.wrapping_sub(RADIUS), y, y + RADIUS].map(|y| reference.row(y));
        for (i, (cell, &side)) in cells.iter_mut().zip(sides).enumerate() {
            cell.side = side;
            if i > 0 {
                around += differences.column(i + RADIUS) - differences.column_before(i);
            }
            if side != BOTH {
                continue;
            }
            let x = columns.start + i;
            let [.., count] = around.to_array();
            let apart = (around.abs() & COLOURS).reduce_add() / count.abs().max(1);
            let change = differences.change(y, i);
            let confidence = preference.confidence.map_or(255, |mask| mask.data()[at + i]);
            let (u, v) = (x - reference.left, y - reference.top);
            let reliable = preference.guide.reliable.is_none_or(|mask| mask.data()[v * photo.0 + u] != 0);
            let lost = i32::from(RELIABLE.saturating_sub(confidence));
            let unlike = apart.min(UNLIKE);
            let (blurred, inside) = match &mosaic {
                Some((labels, detail, inside)) => (detail.cost(labels.data()[at + i]), inside[at + i].into()),
                None => (0, own.as_ref().map_or(0, |own| own.at((x, y)))),
            };
            let inside = inside.saturating_sub(border).min(border) as i32;
            let distorted = DISTORTED * unlike * unlike / UNLIKE * inside / (border as i32 * UNLIKE);
            let extra = if reliable { 0 } else { UNRELIABLE };
            cell.cost = seam_cost(apart, change + CONTRAST * contrast(reference, photo_rows, x) + extra);
            cell.data_cost = (DATA_COST * lost * unlike / (i32::from(RELIABLE) * UNLIKE) + distorted) as i16 + blurred;
        }
    }
    Ok(Some(level))
}

/// By how many levels, over three channels and both axes, the reference changes from [`RADIUS`] pixels before to as many after column `x` of the canvas:
/// only to the pixel itself where the others are masked or beyond its border. `rows` are those above, at and below it.
fn contrast(reference: &Placed<'_>, [above, here, below]: [Option<&[[u8; 4]]>; 3], x: usize) -> i32 {
    let own = reference.pixel(here, x).map_or(i32x4::ZERO, levels);
    let at = |row, x| reference.pixel(row, x).map_or(own, levels);
    let across = at(here, x + RADIUS) - at(here, x.wrapping_sub(RADIUS));
    (across.abs() + (at(below, x) - at(above, x)).abs()).reduce_add()
}

/// Seam cost where the photos differ by `apart` levels, summed over three channels, plus `extra`.
pub(super) fn seam_cost(apart: i32, extra: i32) -> u16 {
    (STEP * apart + STEP * apart * apart / OBJECT + extra).clamp(0, i32::from(u16::MAX / 2)) as u16
}

/// The lanes that are red, green and blue.
const COLOURS: i32x4 = i32x4::new([-1, -1, -1, 0]);

/// Target minus reference in levels, and −1 where it is known; zeros where it is not.
struct Differences<'a> {
    image: &'a Image,
    reference: &'a Placed<'a>,
    seam: &'a Mask,
    columns: Range<usize>,
    /// The last rows, each at its number modulo theirs.
    ring: Vec<i32x4>,
    /// Their sums.
    sums: Vec<i32x4>,
    /// The rows in them.
    rows: Range<usize>,
}

impl<'a> Differences<'a> {
    fn new(image: &'a Image, reference: &'a Placed<'a>, seam: &'a Mask, columns: Range<usize>) -> Result<Self> {
        let (ring, sums) = (zeroed(ROWS * columns.len())?, zeroed(columns.len())?);
        Ok(Self { image, reference, seam, columns, ring, sums, rows: 0..0 })
    }

    /// Looks at the rows around `y`, as far as there are any.
    fn advance(&mut self, y: usize, all: Range<usize>) {
        if self.rows.is_empty() {
            self.rows = all.start..all.start;
        }
        let width = self.columns.len();
        while self.rows.end < (y + RADIUS + 1).min(all.end) {
            let row = self.rows.end;
            let slot = row % ROWS * width..(row % ROWS + 1) * width;
            let photo = self.reference.row(row);
            let at = row * self.seam.width() + self.columns.start;
            let pixels = &self.image.pixels()[at..at + width];
            let sides = &self.seam.data()[at..at + width];
            for ((((x, difference), sum), pixel), &side) in
                self.columns.clone().zip(&mut self.ring[slot]).zip(&mut self.sums).zip(pixels).zip(sides)
            {
                let mut new = i32x4::ZERO;
                if side == BOTH
                    && let Some(other) = self.reference.pixel(photo, x)
                {
                    new = (levels(*pixel) - levels(other)) & COLOURS | !COLOURS;
                }
                *sum += new - *difference;
                *difference = new;
            }
            self.rows.end += 1;
        }
    }

    /// Sum over the rows in a column of the window; nothing outside of it.
    #[inline(always)]
    fn column(&self, i: usize) -> i32x4 {
        self.sums.get(i).copied().unwrap_or(i32x4::ZERO)
    }

    /// The column that the window around `i` has left behind.
    #[inline(always)]
    fn column_before(&self, i: usize) -> i32x4 {
        i.checked_sub(RADIUS + 1).map_or(i32x4::ZERO, |i| self.column(i))
    }

    /// Sum over the window around a column.
    fn around(&self, i: usize) -> i32x4 {
        (i.saturating_sub(RADIUS)..i + RADIUS + 1).fold(i32x4::ZERO, |sum, i| sum + self.column(i))
    }

    /// How much the difference changes from the neighbours to the left and above: that of the gradients.
    #[inline(always)]
    fn change(&self, y: usize, i: usize) -> i32 {
        let width = self.columns.len();
        let row = y % ROWS * width;
        let here = self.ring[row + i];
        let from = |other: i32x4| if other.as_array_ref()[3] != 0 { (here - other).abs().reduce_add() } else { 0 };
        let left = if i > 0 { from(self.ring[row + i - 1]) } else { 0 };
        let above = if y > self.rows.start { from(self.ring[(y + ROWS - 1) % ROWS * width + i]) } else { 0 };
        left + above
    }
}

/// Red, green, blue, 0.
fn levels([r, g, b, _]: [u8; 4]) -> i32x4 {
    i32x4::new([r, g, b, 0].map(i32::from))
}
