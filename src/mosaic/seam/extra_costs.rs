//! What it costs the seam to pass through a cell besides how unlike the photos are there, on the coarsest grid.

use super::level::Level;
use super::{REFERENCE, TARGET};
use crate::Result;
use crate::geometry::Match;
use crate::image::zeroed;

/// What a cell costs on top next to where only one photo is valid, and two cells away half of it. Tuned on the evaluation cases: flat
/// between 160 and 320.
const BORDER: u16 = 160;
/// What a seam costs that passes between the two ends of a match, as a share of what it costs at these. With 1 it rather passes through something
/// that the border of a photo cuts off.
const APART: f32 = 0.5;
/// What is closer, as a share of the overlap's side, is not seen twice but stretched or cut a little: the costs of the cells say it.
const NEAR: f64 = 0.06;
/// A match is one by chance unless so many others as near to it are as far apart, up to this part of the distance.
const SUPPORT: usize = 2;
const ALIKE: f64 = 0.3;

/// Extra costs, of all finer levels as well.
pub(super) struct ExtraCosts {
    costs: Vec<u16>,
    width: usize,
    scale: u32,
}

impl ExtraCosts {
    /// Of being near a border of either photo: a seam there leaves no room to blend.
    pub fn near_borders(level: &Level) -> Result<Self> {
        let mut costs = zeroed(level.cells.len())?;
        let decided = |at: usize| matches!(level.cells[at].side, TARGET | REFERENCE);
        // Behind others that are decided, one is the nearest to nothing that is not.
        let at_border = |at: usize| {
            let mut behind = true;
            level.around(at, 1, &mut |other| behind &= decided(other));
            !behind
        };
        for (reach, cost) in [(3, BORDER / 4), (2, BORDER / 2), (1, BORDER)] {
            for at in (0..level.cells.len()).filter(|&at| decided(at) && at_border(at)) {
                level.around(at, reach, &mut |other| costs[other] = cost);
            }
        }
        costs.iter_mut().enumerate().filter(|(at, _)| decided(*at)).for_each(|(_, cost)| *cost = BORDER);
        Ok(Self { costs, width: level.width, scale: level.scale })
    }

    /// Adds that of passing between the places where target and reference show the same, in pixels of the canvas: with a seam there it would be
    /// seen twice, or not at all. Any seam that separates them crosses the straight line from one to the other. What does not stand out
    /// from what the other photo shows, as grass does not, is not missed.
    pub fn between(mut self, matches: &[Match], level: &Level) -> Self {
        for ends in consistent(matches, level) {
            let cells = ends.into_iter().filter_map(|end| level.cell(end));
            let cost = APART * f32::from(cells.map(|at| level.cells[at].cost).max().unwrap_or(0));
            for_each_cell_between(ends, level, &mut |at| self.costs[at] = self.costs[at].max(cost as u16));
        }
        self
    }

    /// That of a cell (x, y) of this level or a finer one.
    pub fn at(&self, level: &Level, x: usize, y: usize) -> u16 {
        let finer = self.scale - level.scale;
        self.costs[(y >> finer) * self.width + (x >> finer)]
    }
}

/// Where on a level the ends of those matches are that are far apart, and not alone in that.
fn consistent(matches: &[Match], level: &Level) -> Vec<[[f64; 2]; 2]> {
    let near = (NEAR * (level.free() as f64).sqrt()).max(1.0);
    let way = |[from, to]: [[f64; 2]; 2]| [to[0] - from[0], to[1] - from[1]];
    let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let ends = matches.iter().map(|m| [m.target, m.reference].map(|point| level.position(point)));
    let far: Vec<[[f64; 2]; 2]> = ends.filter(|ends| (near..f64::MAX).contains(&length(way(*ends)))).collect();
    let supported = |ends: &[[f64; 2]; 2]| {
        let most = ALIKE * length(way(*ends));
        let supports = |other: &&[[f64; 2]; 2]| {
            length(way([ends[0], other[0]])) < near && length(way([way(*ends), way(**other)])) < most
        };
        // It supports itself.
        far.iter().filter(supports).nth(SUPPORT).is_some()
    };
    far.iter().copied().filter(supported).collect()
}

/// Calls `f` with the cells of a level on the straight line between two positions.
fn for_each_cell_between([from, to]: [[f64; 2]; 2], level: &Level, f: &mut dyn FnMut(usize)) {
    let way = [to[0] - from[0], to[1] - from[1]];
    // Along the axis on which it is longer.
    let k = usize::from(way[1].abs() > way[0].abs());
    let side = [level.width, level.height][k] as f64;
    let [first, last] = [from[k].min(to[k]), from[k].max(to[k])].map(|v| v.clamp(0.0, side));
    for i in 0..=(2.0 * (last - first)).ceil() as usize {
        let t = ((first + 0.5 * i as f64).min(last) - from[k]) / way[k];
        if let Some(at) = level.cell([from[0] + t * way[0], from[1] + t * way[1]]) {
            f(at);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::super::BOTH;
    use super::*;

    /// On a grid of 4 × 4 pixels, for all levels: as expensive as the more expensive end, and nothing where the ends are next to each other
    /// or beyond the grid.
    #[test]
    fn passing_between_matches_costs_what_their_ends_do() {
        let mut finest = Level::empty(8, 0, 40, 12).unwrap();
        for (at, cell) in finest.cells.iter_mut().enumerate() {
            (cell.side, cell.cost) = (BOTH, if (20..24).contains(&(at % 40)) { 800 } else { 100 });
        }
        let coarsest = finest.halved().unwrap().halved().unwrap();
        let extra = |count: usize, target: [f64; 2], reference: [f64; 2]| {
            let costs = ExtraCosts::near_borders(&coarsest).unwrap();
            let costs = costs.between(&vec![Match { target, reference }; count], &coarsest);
            let of_row = |y: usize| (0..40).map(|x| costs.at(&finest, x, y)).collect::<Vec<u16>>();
            [of_row(1), of_row(5)]
        };
        let none = vec![0; 40];
        let expensive: Vec<u16> = (0..40).map(|x| if (8..24).contains(&x) { 400 } else { 0 }).collect();
        assert_eq!(extra(3, [17.0, 5.0], [30.0, 5.0]), [none.clone(), expensive.clone()]);
        assert_eq!(extra(3, [30.0, 5.0], [17.0, 5.0]), [none.clone(), expensive]);
        assert_eq!(extra(3, [30.0, 5.0], [33.0, 5.0]), [none.clone(), none.clone()]);
        let to_the_left: Vec<u16> = (0..40).map(|x| if x < 12 { 50 } else { 0 }).collect();
        assert_eq!(extra(3, [-400.0, 5.0], [17.0, 5.0]), [none.clone(), to_the_left]);
        // One that is alone in it is wrong.
        assert_eq!(extra(1, [17.0, 5.0], [30.0, 5.0]), [none.clone(), none.clone()]);
        assert_eq!(extra(3, [f64::NAN, 5.0], [17.0, 5.0]), [none.clone(), none]);
    }
}
