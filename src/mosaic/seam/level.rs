//! The grid on which the cut is made, at one resolution.

use super::flow::{Flow, NEIGHBOURS};
use super::{BOTH, NONE, REFERENCE, TARGET};
use crate::image::{reserve, zeroed};
use crate::{Mask, Result};

/// What a step of the seam costs in itself.
const STEP: i32 = 12;
/// Cells from the present seam that a finer level may move it.
const BAND: usize = 2;
/// What a cell of the coarsest level costs on top next to where only one photo is valid, and two cells away half of it.
const BORDER: u16 = 160;

/// Extra costs near borders, on the coarsest grid.
pub(super) struct Borders {
    extra: Vec<u16>,
    width: usize,
}

/// A window of the canvas in cells of one size.
pub(super) struct Level {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// Which photos are valid in the cell; [`BOTH`] is where there is something to decide.
    pub sides: Vec<u8>,
    /// What a seam through the cell costs.
    pub costs: Vec<u16>,
    /// Which photo shows: empty until it is decided.
    shown: Vec<u8>,
}

impl Level {
    pub fn empty(left: usize, top: usize, width: usize, height: usize) -> Result<Self> {
        let (sides, costs) = (zeroed(width * height)?, zeroed(width * height)?);
        Ok(Self { left, top, width, height, sides, costs, shown: Vec::new() })
    }

    /// How many cells are to be decided.
    pub fn free(&self) -> usize {
        self.sides.iter().filter(|&&side| side == BOTH).count()
    }

    /// The same at half the resolution.
    pub fn halved(&self) -> Result<Self> {
        let mut half = Self::empty(0, 0, self.width.div_ceil(2), self.height.div_ceil(2))?;
        for y in 0..half.height {
            for x in 0..half.width {
                let (mut counts, mut sum) = ([0u32; 4], 0);
                for j in 2 * y..(2 * y + 2).min(self.height) {
                    for i in 2 * x..(2 * x + 2).min(self.width) {
                        let at = j * self.width + i;
                        let side = self.sides[at];
                        counts[usize::from(side & BOTH)] += 1;
                        if side == BOTH {
                            sum += u32::from(self.costs[at]);
                        }
                    }
                }
                let [_, target, reference, both] = counts;
                let at = y * half.width + x;
                half.sides[at] = match (both, target.max(reference)) {
                    (0, 0) => NONE,
                    (both, most) if both >= most => BOTH,
                    _ if target > reference => TARGET,
                    _ => REFERENCE,
                };
                half.costs[at] = sum.checked_div(both).unwrap_or(0) as u16;
            }
        }
        Ok(half)
    }

    /// Decides for every cell.
    pub fn cut_whole(&mut self, borders: &Borders) -> Result<()> {
        self.shown = self.sides.clone();
        let mut nodes = Vec::new();
        reserve(&mut nodes, self.free())?;
        nodes.extend((0..self.sides.len()).filter(|&at| self.sides[at] == BOTH));
        self.decide(&nodes, borders, 0)
    }

    /// Takes the coarser level's decisions over, and decides anew near the seam.
    pub fn refine(&mut self, coarser: &Self, borders: &Borders, scale: u32) -> Result<()> {
        self.shown = self.sides.clone();
        for (y, row) in self.shown.chunks_exact_mut(self.width).enumerate() {
            let coarse = &coarser.shown[y / 2 * coarser.width..(y / 2 + 1) * coarser.width];
            for (x, shown) in row.iter_mut().enumerate().filter(|(_, shown)| **shown == BOTH) {
                *shown = coarse[x / 2];
            }
        }
        let nodes = self.band()?;
        self.decide(&nodes, borders, scale)
    }

    /// Writes the decisions into the canvas' mask.
    pub fn write(&self, seam: &mut Mask) {
        for (y, row) in self.shown.chunks_exact(self.width).enumerate() {
            let start = (self.top + y) * seam.width + self.left;
            seam.data[start..start + self.width].copy_from_slice(row);
        }
    }

    /// What every cell costs on top for being near a border of either photo: a seam there leaves no room to blend.
    pub fn borders(&self) -> Result<Borders> {
        let mut extra = zeroed(self.costs.len())?;
        for (reach, extra_cost) in [(3, BORDER / 4), (2, BORDER / 2), (1, BORDER)] {
            for (at, _) in self.sides.iter().enumerate().filter(|(_, side)| matches!(**side, TARGET | REFERENCE)) {
                self.around(at, reach, &mut |other| extra[other] = extra_cost);
            }
        }
        Ok(Borders { extra, width: self.width })
    }

    /// Calls `f` with the cells at most `reach` columns and rows away.
    #[inline(never)]
    fn around(&self, at: usize, reach: usize, f: &mut dyn FnMut(usize)) {
        let (x, y) = (at % self.width, at / self.width);
        for j in y.saturating_sub(reach)..(y + reach + 1).min(self.height) {
            for i in x.saturating_sub(reach)..(x + reach + 1).min(self.width) {
                f(j * self.width + i);
            }
        }
    }

    /// The cells near the present seam that are free to change sides.
    fn band(&self) -> Result<Vec<usize>> {
        let mut near: Vec<bool> = zeroed(self.shown.len())?;
        let mut nodes = Vec::new();
        let mut mark = |at: usize| {
            self.around(at, BAND, &mut |other| {
                if self.sides[other] == BOTH && !near[other] {
                    near[other] = true;
                    nodes.push(other);
                }
            });
        };
        for at in 0..self.shown.len() {
            let here = self.shown[at];
            let right = if (at + 1).is_multiple_of(self.width) { here } else { self.shown[at + 1] };
            let below = self.shown.get(at + self.width).copied().unwrap_or(here);
            // 1 and 2 are the only labels that differ in both bits.
            if here ^ right == BOTH || here ^ below == BOTH {
                mark(at);
            }
        }
        Ok(nodes)
    }

    /// A minimum cut over `nodes`; all other cells stay as they are shown.
    fn decide(&mut self, nodes: &[usize], borders: &Borders, scale: u32) -> Result<()> {
        let mut index: Vec<u32> = zeroed(self.shown.len())?; // 0: no node
        for (i, &at) in nodes.iter().enumerate() {
            index[at] = i as u32 + 1;
        }
        let mut flow = Flow::new(nodes.len())?;
        for (i, &at) in nodes.iter().enumerate() {
            let cost = |at: usize| {
                let (x, y) = ((at % self.width) >> scale, (at / self.width) >> scale);
                i32::from(self.costs[at]) + i32::from(borders.extra[y * borders.width + x])
            };
            let own = cost(at);
            for (k, (dx, dy)) in NEIGHBOURS.into_iter().enumerate() {
                let x = (at % self.width).wrapping_add_signed(dx);
                let y = (at / self.width).wrapping_add_signed(dy);
                if x >= self.width || y >= self.height {
                    continue;
                }
                let other = y * self.width + x;
                match (index[other], self.sides[other], self.shown[other]) {
                    (0, BOTH, side) => flow.tie(i, side == TARGET, own + cost(other) + STEP),
                    (0, _, NONE) => {}
                    (0, _, side) => flow.tie(i, side == TARGET, 2 * own + STEP),
                    (node, ..) => flow.link(i, k, node as usize - 1, own + cost(other) + STEP),
                }
            }
        }
        flow.run();
        for (i, &at) in nodes.iter().enumerate() {
            self.shown[at] = if flow.reached(i) { TARGET } else { REFERENCE };
        }
        Ok(())
    }
}
