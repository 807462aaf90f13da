//! Which extrema become keypoints: the strong ones, and weaker ones where there are few.

use super::extrema::Extremum;
use crate::Result;
use crate::image::zeroed;
use crate::sort::{sort, sorted};

/// Cells along the longer side of the photo.
const CELLS: f32 = 12.0;

/// Keeps at most `most` extrema: those with at least the contrast `strong` and, until there are `enough`, the next
/// strongest of every cell of a grid, as evenly as there are any. When the strong ones are too many they are thinned out
/// in the same way. `size` is that of the octave 0 in its pixels. Sorted by octave, level, y, x, without duplicates.
#[inline(never)]
pub(super) fn select(
    found: &[Extremum],
    strong: f32,
    enough: usize,
    most: usize,
    size: (usize, usize),
) -> Result<Vec<Extremum>> {
    let at = |i: u32| &found[i as usize];
    // Fits from neighbouring samples may end at the same one: the same extremum.
    let before = |a: u32, b: u32| at(a).place() < at(b).place();
    let unique = sorted(found.len(), &before)?;
    let mut order = unique.clone();
    sort(&mut order, &|a, b| {
        let (p, q) = (at(a).response, at(b).response);
        if p != q { p > q } else { before(a, b) }
    });
    // The rank of each in its cell, and how many of each rank there are.
    let cell = size.0.max(size.1) as f32 / CELLS;
    let columns = (size.0 as f32 / cell) as usize + 1;
    let mut filled: Vec<u32> = zeroed(columns * ((size.1 as f32 / cell) as usize + 1))?;
    let mut rank: Vec<u32> = zeroed(found.len())?;
    // Of the weak, then of the strong.
    let mut ranks: [Vec<u32>; 2] = [zeroed(order.len() + 1)?, zeroed(order.len() + 1)?];
    let mut strongs = 0;
    for &i in &order {
        let e = at(i);
        let grow = (1u32 << e.octave) as f32;
        let [x, y] = e.pixel.map(|v| (v as f32 * grow / cell) as usize);
        let Some(filled) = filled.get_mut(y * columns + x) else { continue };
        rank[i as usize] = *filled;
        let is_strong = usize::from(e.response >= strong);
        ranks[is_strong][*filled as usize] += 1;
        strongs += is_strong;
        *filled += 1;
    }
    let quota = |ranks: &[u32], mut room: usize| {
        ranks.iter().take_while(|&&n| room.checked_sub(n as usize).map(|left| room = left).is_some()).count() as u32
    };
    let quotas = if strongs > most {
        [0, quota(&ranks[1], most)]
    } else {
        [quota(&ranks[0], enough.min(most).saturating_sub(strongs)), u32::MAX]
    };
    let kept = |&&i: &&u32| rank[i as usize] < quotas[usize::from(at(i).response >= strong)];
    Ok(unique.iter().filter(kept).map(|&i| *at(i)).collect())
}
