//! Which extrema become keypoints: the strong ones, and weaker ones where there are few; spread evenly over the photo.

use super::extrema::Extremum;
use crate::Result;
use crate::image::{indices, zeroed};
use crate::sort::sort_indices;

/// Cells of the grid along the longer side of the photo.
const CELLS: f32 = 12.0;

/// Selects at most `most` extrema: those with a contrast of at least `strong` and, until there are `enough`, the next
/// strongest of every cell of a grid, taken in turn. Too many strong ones are thinned out in the same way. `size` is that of
/// octave 0 in its pixels. The result is sorted by octave, level, y, x, without duplicates.
pub(super) fn select(
    found: &[Extremum],
    strong: f32,
    enough: usize,
    most: usize,
    size: (usize, usize),
) -> Result<Vec<Extremum>> {
    let at = |i: u32| &found[i as usize];
    // Fits that start at neighbouring samples may converge to the same extremum.
    let mut unique = indices(found.len())?;
    sort_indices(&mut unique, &|a, b| (at(a).place(), a).cmp(&(at(b).place(), b)));
    unique.dedup_by_key(|i| at(*i).place());
    let mut order = unique.clone();
    sort_indices(&mut order, &|a, b| {
        at(b).response.total_cmp(&at(a).response).then_with(|| at(a).place().cmp(&at(b).place()))
    });
    // The rank of each in its cell, and how many of each rank there are.
    let cell = size.0.max(size.1) as f32 / CELLS;
    let columns = (size.0 as f32 / cell) as usize + 1;
    let mut filled: Vec<u32> = zeroed(columns * ((size.1 as f32 / cell) as usize + 1))?;
    let mut rank: Vec<u32> = zeroed(found.len())?;
    // Of the weak ones, then of the strong ones.
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
