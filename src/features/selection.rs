//! Which extrema become keypoints: the strong ones, and weaker ones where there are few.

use super::extrema::Extremum;
use super::sort::sort;
use crate::Result;
use crate::image::{reserve, zeroed};

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
    let mut order: Vec<u32> = Vec::new();
    reserve(&mut order, found.len())?;
    order.extend(0..found.len() as u32);
    let at = |i: u32| &found[i as usize];
    // Fits from neighbouring samples may end at the same one: the same extremum.
    let place = |e: &Extremum| (e.octave, e.level, e.pixel[1], e.pixel[0]);
    sort(&mut order, &|a, b| (place(at(a)), a) < (place(at(b)), b));
    order.dedup_by_key(|i| place(at(*i)));

    let unique = order.clone();
    sort(&mut order, &|a, b| {
        let (p, q) = (at(a), at(b));
        if p.response != q.response { p.response > q.response } else { place(p) < place(q) }
    });
    // The rank of each in its cell, and how many of each rank there are.
    let cell = size.0.max(size.1) as f32 / CELLS;
    let columns = (size.0 as f32 / cell) as usize + 1;
    let mut filled: Vec<u32> = zeroed(columns * ((size.1 as f32 / cell) as usize + 1))?;
    let mut rank: Vec<u32> = zeroed(found.len())?;
    let mut strong_ranks: Vec<u32> = zeroed(order.len() + 1)?;
    let mut weak_ranks: Vec<u32> = zeroed(order.len() + 1)?;
    let mut strongs = 0;
    for &i in &order {
        let e = at(i);
        let grow = (1u32 << e.octave) as f32;
        let [x, y] = e.pixel.map(|v| (v as f32 * grow / cell) as usize);
        let Some(filled) = filled.get_mut(y * columns + x) else { continue };
        rank[i as usize] = *filled;
        if e.response >= strong {
            strong_ranks[*filled as usize] += 1;
            strongs += 1;
        } else {
            weak_ranks[*filled as usize] += 1;
        }
        *filled += 1;
    }
    let quota = |ranks: &[u32], mut room: usize| {
        ranks.iter().take_while(|&&n| room.checked_sub(n as usize).map(|left| room = left).is_some()).count() as u32
    };
    let (strong_quota, weak_quota) = if strongs > most {
        (quota(&strong_ranks, most), 0)
    } else {
        (u32::MAX, quota(&weak_ranks, enough.min(most).saturating_sub(strongs)))
    };
    let kept = |e: &Extremum, rank: u32| rank < if e.response >= strong { strong_quota } else { weak_quota };
    Ok(unique.into_iter().filter(|&i| kept(at(i), rank[i as usize])).map(|i| *at(i)).collect())
}
