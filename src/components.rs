//! Connected components of a grid.

use crate::Result;
use crate::image::reserve;

/// Calls `each` with the cells of every 4-connected component of equal labels, in the order of their first cells. Row by
/// row, `width` cells a row; cells labelled 0 belong to none.
pub(crate) fn connected_components(mut labels: Vec<u8>, width: usize, each: &mut dyn FnMut(&[u32])) -> Result<()> {
    let mut component: Vec<u32> = Vec::new();
    reserve(&mut component, labels.len())?;
    for first in 0..labels.len() {
        // A cell that has been reached loses its label.
        let label = std::mem::take(&mut labels[first]);
        if label == 0 {
            continue;
        }
        component.clear();
        component.push(first as u32);
        let mut next = 0;
        while let Some(&at) = component.get(next) {
            for other in neighbours(at as usize, width) {
                if labels.get(other) == Some(&label) {
                    labels[other] = 0;
                    component.push(other as u32); // each cell once, so there is room
                }
            }
            next += 1;
        }
        each(&component);
    }
    Ok(())
}

/// The cells to the left, to the right, above and below; where there is none, a number that is no cell's.
pub(crate) fn neighbours(at: usize, width: usize) -> [usize; 4] {
    let x = at % width;
    let left = if x > 0 { at - 1 } else { usize::MAX };
    let right = if x + 1 < width { at + 1 } else { usize::MAX };
    [left, right, at.wrapping_sub(width), at + width]
}
