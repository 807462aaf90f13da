//! Multiband blending.
//!
//! After P. Burt and E. Adelson, *A Multiresolution Spline with Application to Image Mosaics*, ACM Trans. Graph. 2 (1983).
//! Their mosaic Σ M·L(A) + (1 − M)·L(B), a sum over the bands of two pyramids, is B + Σ M·L(A − B): only the
//! photos' difference needs a pyramid, and that is known just where both are valid and extrapolated smoothly elsewhere.
//! So no border of either photo gets into a band, and nothing can shine through a void.

use std::ops::Range;

use wide::f32x4;

use super::canvas::Placed;
use super::seam::{self, NONE, REFERENCE, TARGET};
use crate::image::{reserve, zeroed};
use crate::observer::{Observer, Portion, report_row};
use crate::upsampling::{WEIGHTS, neighbours};
use crate::{Image, Mask, Result, Stage};

/// While the pyramid is built: weighted difference (red, green, blue) and weight; labelled-as-target, labelled, 0, 0.
/// When it is done: difference; its blended part (both red, green, blue and nothing of meaning).
type Cell = [f32x4; 2];

/// Differences of this many levels count half: they are misalignment rather than exposure, and belong to the finest band,
/// which is not mixed at all. Elsewhere ghosts would spread over the widths of the coarser bands.
const TOLERANCE: f32 = 128.0;
/// Weight below which a cell's difference is taken from the coarser level.
const MIN_WEIGHT: f32 = 0.02;

/// A level of the pyramid.
struct Level {
    cells: Vec<Cell>,
    width: usize,
    height: usize,
}

/// Bands where [`BlendOptions::bands`](super::BlendOptions::bands) is 0, of a reference of this width and height: what a lens darkens
/// towards the corners differs over a good part of a photo, and shows in skies if that passes over in less.
pub(super) fn default_bands((width, height): (usize, usize)) -> u32 {
    (width.max(height) / 8).max(2).ilog2()
}

/// Blends the reference into `image`, which holds the target. `bands` as in [`super::BlendOptions`].
pub(super) fn blend(
    image: &mut Image,
    reference: &Placed<'_>,
    seam: &Mask,
    bands: u32,
    observer: &mut dyn Observer,
) -> Result<()> {
    let bands = if bands == 0 { default_bands(reference.photo.size()) } else { bands } as usize;
    let Some(bounds) = seam::bounds(seam) else {
        return paste(image, reference, seam, observer);
    };
    let (columns, rows) = bounds.grown(3 << bands, seam.size()).ranges();
    let mut levels: Vec<Level> = Vec::new();
    let source = Source { image, reference, seam, columns: columns.clone(), rows: rows.clone() };
    levels.push(reduce(
        columns.len(),
        rows.len(),
        &|y, row| source.row(y, row),
        &mut Portion::new(observer, 0.0, 0.5),
    )?);
    for _ in 1..bands {
        let Some(fine) = levels.last().filter(|level| level.width.max(level.height) > 1) else { break };
        let row = |y: usize, row: &mut [Cell]| {
            row.copy_from_slice(&fine.cells[y * fine.width..(y + 1) * fine.width]);
        };
        let coarse = reduce(fine.width, fine.height, &row, &mut Portion::new(observer, 0.5, 0.5))?;
        levels.push(coarse);
    }
    let mut coarser: Option<Level> = None;
    while let Some(mut level) = levels.pop() {
        collapse(&mut level, coarser.as_ref());
        coarser = Some(level);
    }
    let Some(correction) = coarser else { return Ok(()) };
    apply(image, reference, seam, &correction, (columns, rows), &mut Portion::new(observer, 0.6, 1.0))
}

/// The photos in the rectangle that is blended.
struct Source<'a> {
    image: &'a Image,
    reference: &'a Placed<'a>,
    seam: &'a Mask,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Source<'_> {
    fn row(&self, y: usize, out: &mut [Cell]) {
        let y = self.rows.start + y;
        let start = y * self.image.width();
        let target = &self.image.pixels()[start + self.columns.start..start + self.columns.end];
        let shown = &self.seam.data()[start + self.columns.start..start + self.columns.end];
        let photo = self.reference.row(y);
        for (((cell, target), &shown), x) in out.iter_mut().zip(target).zip(shown).zip(self.columns.clone()) {
            let mut difference = f32x4::ZERO;
            if target[3] != 0
                && let Some(other) = self.reference.pixel(photo, x)
            {
                let [r, g, b] = [0, 1, 2].map(|c| f32::from(target[c]) - f32::from(other[c]));
                let weight = TOLERANCE * TOLERANCE / (TOLERANCE * TOLERANCE + (r * r + g * g + b * b));
                difference = f32x4::new([r, g, b, 1.0]) * f32x4::splat(weight);
            }
            let [labelled, is_target] = [shown != NONE, shown == TARGET].map(|is| f32::from(u8::from(is)));
            *cell = [difference, f32x4::new([is_target, labelled, 0.0, 0.0])];
        }
    }
}

/// REDUCE: half the size, filtered by (1 3 3 1) / 8 both ways; borders are replicated.
fn reduce(
    width: usize,
    height: usize,
    source: &dyn Fn(usize, &mut [Cell]),
    observer: &mut dyn Observer,
) -> Result<Level> {
    let (w, h) = (width.div_ceil(2), height.div_ceil(2));
    let mut cells = Vec::new();
    reserve(&mut cells, w * h)?;
    let mut full: Vec<Cell> = zeroed(width)?;
    let mut ring: Vec<Cell> = zeroed(4 * w)?;
    let mut ready = 0;
    for y in 0..h {
        report_row(observer, Stage::Blend, y, h)?;
        while ready < height.min(2 * y + 3) {
            source(ready, &mut full);
            for (x, cell) in ring[ready % 4 * w..][..w].iter_mut().enumerate() {
                *cell = downsampled(x, width, &|x| &full[x]);
            }
            ready += 1;
        }
        cells.extend((0..w).map(|x| downsampled(y, height, &|y| &ring[y % 4 * w + x])));
    }
    Ok(Level { cells, width: w, height: h })
}

/// The cell `at` of half the resolution along one axis.
fn downsampled<'a>(at: usize, length: usize, cells: &dyn Fn(usize) -> &'a Cell) -> Cell {
    let cell = |i: usize| cells(i.min(length - 1));
    let (a, b, c, d) = (cell((2 * at).saturating_sub(1)), cell(2 * at), cell(2 * at + 1), cell(2 * at + 2));
    [0, 1].map(|i| (a[i] + d[i]) * f32x4::splat(0.125) + (b[i] + c[i]) * f32x4::splat(0.375))
}

impl Level {
    /// EXPAND: the cell at (x, y) of twice the resolution.
    fn expanded(&self, x: usize, y: usize) -> Cell {
        let ([x, beside], [y, beyond]) = (neighbours(x, self.width), neighbours(y, self.height));
        let lean = |near: f32x4, far: f32x4| near * f32x4::splat(WEIGHTS[0]) + far * f32x4::splat(WEIGHTS[1]);
        let (row, other) = (y * self.width, beyond * self.width);
        let [a, b, c, d] = [row + x, other + x, row + beside, other + beside].map(|at| &self.cells[at]);
        [0, 1].map(|i| lean(lean(a[i], b[i]), lean(c[i], d[i])))
    }
}

/// Collapses the pyramid by one level: turns sums into the level's difference and its blended part, given those of the next
/// coarser level.
fn collapse(level: &mut Level, coarser: Option<&Level>) {
    for (i, cell) in level.cells.iter_mut().enumerate() {
        let [base, blended] =
            coarser.map_or(Cell::default(), |coarser| coarser.expanded(i % level.width, i / level.width));
        let [sum, labels] = *cell;
        let ([_, _, _, weight], [target, labelled, ..]) = (sum.to_array(), labels.to_array());
        let share = if labelled > 0.0 { target / labelled } else { 0.5 };
        let difference = (sum + base * f32x4::splat(MIN_WEIGHT)) * f32x4::splat(1.0 / (weight + MIN_WEIGHT));
        *cell = [difference, blended + (difference - base) * f32x4::splat(share)];
    }
}

/// Shows the photo of the label, plus what the coarser bands of the other contribute.
fn apply(
    image: &mut Image,
    reference: &Placed<'_>,
    seam: &Mask,
    correction: &Level,
    (columns, rows): (Range<usize>, Range<usize>),
    observer: &mut dyn Observer,
) -> Result<()> {
    paste(image, reference, seam, &mut Portion::new(observer, 0.0, 0.2))?;
    let observer = &mut Portion::new(observer, 0.2, 1.0);
    let width = image.width();
    for y in rows.clone() {
        report_row(observer, Stage::Blend, y - rows.start, rows.len())?;
        let range = y * width + columns.start..y * width + columns.end;
        let pixels = &mut image.pixels_mut()[range.clone()];
        for ((x, pixel), &shown) in pixels.iter_mut().enumerate().zip(&seam.data()[range]) {
            if shown == NONE {
                continue;
            }
            let [difference, blended] = correction.expanded(x, y - rows.start);
            let change = if shown == TARGET { blended - difference } else { blended };
            for (own, change) in pixel.iter_mut().take(3).zip(change.to_array()) {
                // The conversion saturates.
                *own = (f32::from(*own) + change + 0.5) as u8;
            }
        }
    }
    Ok(())
}

/// The reference where it shows.
fn paste(image: &mut Image, reference: &Placed<'_>, seam: &Mask, observer: &mut dyn Observer) -> Result<()> {
    let (width, height) = image.size();
    let rows = image.pixels_mut().chunks_exact_mut(width).zip(seam.data().chunks_exact(width));
    for (y, (row, shown)) in rows.enumerate() {
        report_row(observer, Stage::Blend, y, height)?;
        let Some(photo) = reference.row(y) else { continue };
        let over = row[reference.left..].iter_mut().zip(&shown[reference.left..]);
        for ((pixel, &shown), &[r, g, b, _]) in over.zip(photo) {
            if shown == REFERENCE {
                *pixel = [r, g, b, 255];
            }
        }
    }
    Ok(())
}
