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

    /// Decides for every cell. With a coarser level that is decided already, takes its decisions over, and decides anew
    /// near the seam. `scale` is how many times the borders' grid is coarser by a half.
    pub fn cut(&mut self, coarser: Option<&Self>, borders: &Borders, scale: u32) -> Result<()> {
        let cells = self.sides.len();
        self.shown = zeroed(cells)?;
        self.shown.copy_from_slice(&self.sides);
        let mut index: Vec<u32> = zeroed(cells)?; // 0: no node
        if let Some(coarser) = coarser {
            for at in (0..cells).filter(|&at| self.sides[at] == BOTH) {
                self.shown[at] = coarser.shown[at / self.width / 2 * coarser.width + at % self.width / 2];
            }
            for at in 0..cells {
                let here = self.shown[at];
                let right = if (at + 1).is_multiple_of(self.width) { here } else { self.shown[at + 1] };
                let below = self.shown.get(at + self.width).copied().unwrap_or(here);
                // 1 and 2 are the only labels that differ in both bits.
                if here ^ right == BOTH || here ^ below == BOTH {
                    self.around(at, BAND, &mut |other| index[other] = 1);
                }
            }
        } else {
            index.fill(1);
        }
        let mut nodes: Vec<usize> = Vec::new();
        reserve(&mut nodes, index.iter().filter(|index| **index != 0).count())?;
        for (at, index) in index.iter_mut().enumerate().filter(|(_, index)| **index != 0) {
            *index = 0;
            if self.sides[at] == BOTH {
                nodes.push(at);
                *index = nodes.len() as u32;
            }
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
