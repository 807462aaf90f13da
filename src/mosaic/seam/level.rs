//! The grid on which the cut is made, at one resolution.

use super::extra_costs::ExtraCosts;
use super::flow::{Flow, NEIGHBOURS};
use super::{BOTH, NONE, REFERENCE, TARGET, islands};
use crate::image::{defaults, zeroed};
use crate::{Mask, Result};

/// What a step of the seam costs in itself. Tuned on the evaluation cases: flat between 8 and 16, at 32 there are 3 % more
/// visible steps.
const STEP: i32 = 16;
/// An island is at least one in so many of the cells that both photos cover. Flat between 200 and 800 on the evaluation cases.
const ISLANDS: usize = 400;
/// Cells from the present seam that a finer level may move it. Flat between 1 and 4 on the evaluation cases.
const BAND: usize = 2;

/// A place of a [`Level`].
#[derive(Clone, Copy, Default)]
pub(super) struct Cell {
    /// Which photos are valid; [`BOTH`] is where there is something to decide.
    pub side: u8,
    /// Which photo shows: nothing until it is decided.
    pub shown: u8,
    /// Seam cost.
    pub cost: u16,
    /// Data cost of showing the target rather than the reference.
    pub data_cost: i16,
}

/// A window of the canvas in cells of one size.
pub(super) struct Level {
    /// Pixels of the canvas to the left of it, and above.
    left: usize,
    top: usize,
    pub width: usize,
    pub height: usize,
    /// A cell has 2 to the power of this pixels along a side.
    pub scale: u32,
    pub cells: Vec<Cell>,
}

impl Level {
    pub fn empty(left: usize, top: usize, width: usize, height: usize) -> Result<Self> {
        Ok(Self { left, top, width, height, scale: 0, cells: defaults(width * height)? })
    }

    /// How many cells are to be decided.
    pub fn free(&self) -> usize {
        self.cells.iter().filter(|cell| cell.side == BOTH).count()
    }

    /// The same at half the resolution.
    pub fn halved(&self) -> Result<Self> {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut half = Self { scale: self.scale + 1, ..Self::empty(self.left, self.top, width, height)? };
        let (mut x, mut y) = (0, 0);
        for cell in &mut half.cells {
            let (mut counts, mut sum, mut data) = ([0u32; 4], 0, 0i32);
            for (i, j) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
                if i < self.width && j < self.height {
                    let fine = &self.cells[j * self.width + i];
                    counts[usize::from(fine.side & BOTH)] += 1;
                    if fine.side == BOTH {
                        (sum, data) = (sum + u32::from(fine.cost), data + i32::from(fine.data_cost));
                    }
                }
            }
            let [_, target, reference, both] = counts;
            cell.side = match (both, target.max(reference)) {
                (0, 0) => NONE,
                (both, most) if both >= most => BOTH,
                _ if target > reference => TARGET,
                _ => REFERENCE,
            };
            cell.cost = sum.checked_div(both).unwrap_or(0) as u16;
            // A cell has four times the pixels, and twice the sides of pixels: these are the unit.
            cell.data_cost =
                (2 * data).checked_div(both as i32).unwrap_or(0).clamp(i16::MIN.into(), i16::MAX.into()) as i16;
            x += 2;
            if x >= self.width {
                (x, y) = (0, y + 2);
            }
        }
        Ok(half)
    }

    /// Leaves no islands smaller than a small share of what was to be decided.
    pub fn merge_islands(&mut self) -> Result<()> {
        let least = self.free() / ISLANDS;
        islands::merge(&mut self.cells, self.width, least)
    }

    /// Writes the decisions into the canvas' mask.
    pub fn write(&self, seam: &mut Mask) {
        let width = seam.width();
        let rows = seam.data_mut().chunks_mut(width).skip(self.top).zip(self.cells.chunks(self.width));
        for (row, cells) in rows {
            row[self.left..].iter_mut().zip(cells).for_each(|(shown, cell)| *shown = cell.shown);
        }
    }

    /// In cells from the top left one, where a point of the canvas is.
    pub fn position(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let side = f64::from(1u32 << self.scale);
        [(x + 0.5 - self.left as f64) / side, (y + 0.5 - self.top as f64) / side]
    }

    /// The cell at such a position; `None` where there is none.
    pub fn cell(&self, [x, y]: [f64; 2]) -> Option<usize> {
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then_some(y as usize * self.width + x as usize)
    }

    /// Calls `f` with the cells at most `reach` columns and rows away.
    pub fn around(&self, at: usize, reach: usize, f: &mut dyn FnMut(usize)) {
        let (x, y) = (at % self.width, at / self.width);
        for j in y.saturating_sub(reach)..(y + reach + 1).min(self.height) {
            for i in x.saturating_sub(reach)..(x + reach + 1).min(self.width) {
                f(j * self.width + i);
            }
        }
    }

    /// Decides for every cell. With a coarser level that is decided already, takes its decisions over, and decides anew
    /// near the seam.
    pub fn cut(&mut self, coarser: Option<&Self>, extra: &ExtraCosts) -> Result<()> {
        for (y, row) in self.cells.chunks_mut(self.width).enumerate() {
            for (x, cell) in row.iter_mut().enumerate() {
                cell.shown = cell.side;
                if let Some(coarser) = coarser.filter(|_| cell.side == BOTH) {
                    cell.shown = coarser.cells[y / 2 * coarser.width + x / 2].shown;
                }
            }
        }
        let (nodes, count) = self.number(coarser.is_none())?;
        let mut flow = Flow::new(count)?;
        let cost =
            |at: usize| i32::from(self.cells[at].cost) + i32::from(extra.at(self, at % self.width, at / self.width));
        for (at, (cell, &node)) in self.cells.iter().zip(&nodes).enumerate().filter(|(_, (_, node))| **node != 0) {
            let (i, own) = (node as usize - 1, cost(at));
            flow.terminal_link(i, false, i32::from(cell.data_cost));
            for (k, (dx, dy)) in NEIGHBOURS.into_iter().enumerate() {
                let x = (at % self.width).wrapping_add_signed(dx);
                let y = (at / self.width).wrapping_add_signed(dy);
                if x >= self.width || y >= self.height {
                    continue;
                }
                let other = y * self.width + x;
                let (Cell { side, shown, .. }, node) = (self.cells[other], nodes[other]);
                if node != 0 {
                    flow.neighbour_link(i, k, node as usize - 1, own + cost(other) + STEP);
                } else if shown != NONE {
                    let beyond = if side == BOTH { cost(other) } else { own };
                    flow.terminal_link(i, shown == TARGET, own + beyond + STEP);
                }
            }
        }
        flow.run();
        for (cell, &node) in self.cells.iter_mut().zip(&nodes).filter(|(_, node)| **node != 0) {
            cell.shown = if flow.reached(node as usize - 1) { TARGET } else { REFERENCE };
        }
        Ok(())
    }

    /// Numbers the cells that are free to change sides, `all` or those near the present seam, from 1 on, the others 0; and how many
    /// there are.
    fn number(&self, all: bool) -> Result<(Vec<u32>, usize)> {
        let mut near: Vec<u8> = zeroed(self.cells.len())?;
        let mut at = 0;
        for row in self.cells.chunks(self.width) {
            let below = self.cells.get(at + self.width..).filter(|below| !below.is_empty()).unwrap_or(row);
            for (x, (here, below)) in row.iter().zip(below).enumerate() {
                // 1 and 2 are the only labels that differ in both bits.
                let right = row.get(x + 1).unwrap_or(here);
                if here.shown ^ right.shown == BOTH || here.shown ^ below.shown == BOTH {
                    self.around(at, BAND, &mut |other| near[other] = 1);
                }
                at += 1;
            }
        }
        let mut nodes = zeroed(self.cells.len())?;
        let mut count = 0;
        for ((node, cell), &near) in nodes.iter_mut().zip(&self.cells).zip(&near) {
            if cell.side == BOTH && (all || near != 0) {
                count += 1;
                *node = count;
            }
        }
        Ok((nodes, count as usize))
    }
}
