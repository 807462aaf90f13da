//! Islands of one photo in the other.

use super::level::Cell;
use super::{BOTH, NONE};
use crate::Result;
use crate::image::{reserve, zeroed};

/// Gives every island that is free to change sides and smaller than `least` cells to the photo around it.
pub(super) fn merge(cells: &mut [Cell], width: usize, least: usize) -> Result<()> {
    let mut seen: Vec<u8> = zeroed(cells.len())?;
    let mut island: Vec<u32> = Vec::new();
    reserve(&mut island, cells.len())?;
    for first in 0..cells.len() {
        let Cell { shown, .. } = cells[first];
        if seen[first] != 0 || shown == NONE {
            continue;
        }
        island.clear();
        island.push(first as u32);
        seen[first] = 1;
        let (mut next, mut fixed) = (0, false);
        while let Some(&at) = island.get(next) {
            let at = at as usize;
            fixed |= cells[at].side != BOTH;
            let x = at % width;
            for (there, other) in [
                (x > 0, at.wrapping_sub(1)),
                (x + 1 < width, at + 1),
                (true, at.wrapping_sub(width)),
                (true, at + width),
            ] {
                if there && cells.get(other).is_some_and(|cell| cell.shown == shown) && seen[other] == 0 {
                    seen[other] = 1;
                    island.push(other as u32); // each cell once, so there is room
                }
            }
            next += 1;
        }
        if !fixed && island.len() < least {
            island.iter().for_each(|&at| cells[at as usize].shown = BOTH - shown);
        }
    }
    Ok(())
}
