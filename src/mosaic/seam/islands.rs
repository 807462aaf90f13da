//! Islands of one photo in the other.

use super::BOTH;
use super::level::Cell;
use crate::Result;
use crate::components::connected_components;
use crate::image::reserve;

/// Gives every island that is free to change sides and smaller than `least` cells to the photo around it.
pub(super) fn merge(cells: &mut [Cell], width: usize, least: usize) -> Result<()> {
    let mut shown = Vec::new();
    reserve(&mut shown, cells.len())?;
    shown.extend(cells.iter().map(|cell| cell.shown));
    connected_components(shown, width, least, &mut |island| {
        if island.iter().all(|span| cells[span.clone()].iter().all(|cell| cell.side == BOTH)) {
            for cell in island.iter().flat_map(|span| span.clone()) {
                let shown = &mut cells[cell].shown;
                *shown = BOTH - *shown;
            }
        }
    })
}
