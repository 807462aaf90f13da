//! A window of the picture at one resolution.

use crate::Result;
use crate::image::{filled, reserve, zeroed};

/// Side of the patches that are compared, in pixels.
pub(super) const SIDE: usize = 8;
/// Pixels of a patch before the one it is named after.
pub(super) const BEFORE: usize = 3;
/// Cells around the window, so that no patch leaves it.
pub(super) const PAD: usize = 4;

/// A pixel to be filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Void {
    /// Where in the level.
    pub cell: usize,
    /// Inverse depth of the background around.
    pub far: f32,
    /// Inverse depth from which on something is nearer than the background; finite, so that ∞ always is.
    pub limit: f32,
}

/// Row by row, `width` cells a row, [`PAD`] of them on each side.
pub(super) struct Level {
    pub width: usize,
    pub height: usize,
    /// Red, green, blue, 0.
    pub colour: Vec<[u8; 4]>,
    /// Inverse depth of known pixels, −∞ where it has no value; ∞ at all other cells.
    pub depth: Vec<f32>,
    /// The mask of the patch comparison: all ones where pixels count, 0 at what is nearer than the background and at what is not
    /// known.
    pub seen: Vec<u32>,
    /// Greatest depth in the patch: ∞ unless all of it is known.
    pub nearest: Vec<f32>,
    /// Number of the void at a cell, counted from 1; 0 elsewhere.
    pub index: Vec<u32>,
    /// Row by row.
    pub voids: Vec<Void>,
    /// Every how many columns and rows a target patch is centred.
    pub stride: usize,
    /// Numbers of the voids at their centres, counted from 0.
    pub centres: Vec<u32>,
}

impl Level {
    /// A level of width × height cells and the padding, nothing known.
    pub fn new(width: usize, height: usize) -> Result<Self> {
        let (width, height) = (width + 2 * PAD, height + 2 * PAD);
        let cells = width * height;
        Ok(Self {
            width,
            height,
            colour: zeroed(cells)?,
            depth: filled(cells, f32::INFINITY)?,
            seen: Vec::new(),
            nearest: Vec::new(),
            index: zeroed(cells)?,
            voids: Vec::new(),
            stride: 1,
            centres: Vec::new(),
        })
    }

    /// The cell at (x, y) of the window.
    pub fn cell(&self, x: usize, y: usize) -> usize {
        (y + PAD) * self.width + x + PAD
    }

    /// Position in the window of a cell that is not padding.
    pub fn position(&self, cell: usize) -> (usize, usize) {
        (cell % self.width - PAD, cell / self.width - PAD)
    }

    /// Columns and rows without the padding.
    pub fn size(&self) -> (usize, usize) {
        (self.width - 2 * PAD, self.height - 2 * PAD)
    }

    /// Adds a void behind all others.
    pub fn push(&mut self, void: Void) -> Result<()> {
        if self.voids.len() == self.voids.capacity() {
            let more = self.voids.len().max(1024);
            reserve(&mut self.voids, more)?;
        }
        self.voids.push(void);
        self.index[void.cell] = self.voids.len() as u32;
        Ok(())
    }

    /// The level of half the resolution. A cell is a void when one of the four below is; else it is as near as the
    /// nearest known one of them, so that the background shrinks and never mixes with what is in front.
    pub fn halved(&self) -> Result<Self> {
        let (width, height) = self.size();
        let mut half = Self::new(width.div_ceil(2), height.div_ceil(2))?;
        let (columns, rows) = half.size();
        for y in 0..rows {
            for x in 0..columns {
                let first = self.cell(2 * x, 2 * y);
                // The padding stands in for what an odd side lacks.
                let below = [first, first + 1, first + self.width, first + self.width + 1];
                let cell = half.cell(x, y);
                let (mut far, mut limit, mut voids) = (0.0, f32::MAX, 0.0);
                for void in below.iter().filter_map(|&at| self.voids.get((self.index[at] as usize).wrapping_sub(1))) {
                    far += void.far;
                    limit = void.limit.min(limit);
                    voids += 1.0;
                }
                if voids > 0.0 {
                    half.push(Void { cell, far: far / voids, limit })?;
                    continue;
                }
                let (mut sum, mut known, mut depth) = ([0u32; 4], 0, f32::NEG_INFINITY);
                for at in below.into_iter().filter(|&at| self.depth[at] < f32::INFINITY) {
                    sum.iter_mut().zip(self.colour[at]).for_each(|(sum, c)| *sum += u32::from(c));
                    known += 1;
                    depth = depth.max(self.depth[at]);
                }
                if known > 0 {
                    half.colour[cell] = sum.map(|sum| ((sum + known / 2) / known) as u8);
                    half.depth[cell] = depth;
                }
            }
        }
        Ok(half)
    }

    /// Works out what comparing patches needs, one patch in `stride`×`stride` cells.
    pub fn prepare(&mut self, stride: usize) -> Result<()> {
        self.stride = stride;
        let is_centre =
            |void: &Void| [void.cell % self.width, void.cell / self.width].iter().all(|at| at % stride == 0);
        reserve(&mut self.centres, self.voids.iter().filter(|void| is_centre(void)).count())?;
        self.centres.extend((0..).zip(&self.voids).filter(|(_, void)| is_centre(void)).map(|(number, _)| number));
        self.nearest = self.greatest_in_patch()?;
        // What is too near for the void next to it. Voids farther inside see no known pixel.
        let mut limits = filled(self.depth.len(), f32::INFINITY)?;
        for void in &self.voids {
            let edge = [1, self.width]
                .into_iter()
                .any(|step| self.index[void.cell - step] == 0 || self.index[void.cell + step] == 0);
            if !edge {
                continue;
            }
            let corner = void.cell - PAD * self.width - PAD;
            for row in 0..=2 * PAD {
                let at = corner + row * self.width;
                limits[at..=at + 2 * PAD].iter_mut().for_each(|limit| *limit = limit.min(void.limit));
            }
        }
        let mut seen = Vec::new();
        reserve(&mut seen, self.depth.len())?;
        let cells = self.depth.iter().zip(&limits).zip(&self.index);
        seen.extend(cells.map(|((&depth, &limit), &index)| {
            let known = depth < f32::INFINITY && depth <= limit;
            if known || index != 0 { u32::MAX } else { 0 }
        }));
        self.seen = seen;
        Ok(())
    }

    /// Maximum of the depth over the patch of each cell, along rows and then along columns; ∞ in the padding.
    fn greatest_in_patch(&self) -> Result<Vec<f32>> {
        let mut out = Vec::new();
        reserve(&mut out, self.depth.len())?;
        out.extend_from_slice(&self.depth);
        // Doubling: the maximum over 2, 4 and 8 cells from each one on.
        for reach in [1, self.width, 2, 2 * self.width, 4, 4 * self.width] {
            for at in 0..out.len() - reach {
                out[at] = if out[at] > out[at + reach] { out[at] } else { out[at + reach] };
            }
        }
        // From the patch's first cell to the one it is named after.
        let shift = BEFORE * (self.width + 1);
        let end = out.len() - shift;
        out.copy_within(..end, shift);
        out[..shift].fill(f32::INFINITY);
        for (at, v) in out.iter_mut().enumerate() {
            let (x, y) = (at % self.width, at / self.width);
            if x < PAD || y < PAD || x + PAD >= self.width || y + PAD >= self.height {
                *v = f32::INFINITY;
            }
        }
        Ok(out)
    }
}
