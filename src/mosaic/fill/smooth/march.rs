//! In which order voids are filled.

use super::super::distance::{DIAGONAL, STRAIGHT};
use super::window::{Cell, Window};
use crate::Result;
use crate::image::{reserve, zeroed};

/// One list per distance still open: the farthest is one diagonal step ahead.
const OPEN: usize = DIAGONAL as usize + 1;

/// Reachable void cells by distance from the known ones.
pub(super) struct Order {
    /// Cells of the window, nearest first, row by row within a distance.
    pub pixels: Vec<usize>,
    /// Where in `pixels` each distance ends.
    ends: Vec<usize>,
}

impl Order {
    /// The cells of one distance after the other.
    pub fn fronts(&self) -> impl Iterator<Item = &[usize]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&from, &to)| &self.pixels[from..to])
    }
}

/// Dijkstra's algorithm through the voids, from all known cells at once; integer lengths need no heap.
pub(super) fn order(window: &Window) -> Result<Order> {
    let Window { cells, width, .. } = window;
    let steps = steps(*width);
    let mut distance: Vec<u32> = zeroed(cells.len())?; // 0: not reached
    let mut open: [Vec<usize>; OPEN] = Default::default();

    for cell in (0..cells.len()).filter(|&cell| cells[cell] == Cell::Void) {
        let known = |&(step, _): &(isize, u32)| cells[cell.wrapping_add_signed(step)] == Cell::Known;
        if let Some(&(_, length)) = steps.iter().find(|step| known(step)) {
            distance[cell] = length;
            push(&mut open[length as usize], cell)?;
        }
    }
    let mut now = 0;
    while open.iter().any(|list| !list.is_empty()) {
        let mut list = std::mem::take(&mut open[now as usize % OPEN]);
        list.retain(|&cell| distance[cell] == now); // the others were reached on a shorter way since
        for &cell in &list {
            for (step, length) in steps {
                let next = cell.wrapping_add_signed(step);
                let reached = distance[next];
                if cells[next] == Cell::Void && (reached == 0 || now + length < reached) {
                    distance[next] = now + length;
                    push(&mut open[(now + length) as usize % OPEN], next)?;
                }
            }
        }
        list.clear();
        open[now as usize % OPEN] = list; // keeps its memory
        now += 1;
    }
    sorted(&distance, now as usize)
}

/// All cells with a distance above 0 and below `limit`, by counting.
fn sorted(distance: &[u32], limit: usize) -> Result<Order> {
    let mut ends: Vec<usize> = zeroed(limit + 1)?;
    let reached = || (0..distance.len()).filter(|&cell| distance[cell] != 0);
    reached().for_each(|cell| ends[distance[cell] as usize + 1] += 1);
    for i in 1..ends.len() {
        ends[i] += ends[i - 1];
    }
    let mut pixels: Vec<usize> = zeroed(ends[limit])?;
    for cell in reached() {
        let place = &mut ends[distance[cell] as usize];
        pixels[*place] = cell;
        *place += 1; // from where the distance begins to where it ends
    }
    Ok(Order { pixels, ends })
}

/// The eight neighbours, straight ones first.
fn steps(width: usize) -> [(isize, u32); 8] {
    let down = width.cast_signed();
    [
        (-1, STRAIGHT),
        (1, STRAIGHT),
        (-down, STRAIGHT),
        (down, STRAIGHT),
        (-down - 1, DIAGONAL),
        (-down + 1, DIAGONAL),
        (down - 1, DIAGONAL),
        (down + 1, DIAGONAL),
    ]
}

fn push<T>(list: &mut Vec<T>, value: T) -> Result<()> {
    if list.len() == list.capacity() {
        reserve(list, list.len().max(64))?;
    }
    list.push(value);
    Ok(())
}
