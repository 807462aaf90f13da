//! Connected components of a grid.

use crate::Result;
use crate::image::reserve_more;

/// Cells of a component that are kept in any case, so that forgetting some is worth while.
const FRONT: usize = 4096;

/// Calls `each` with the cells of every 4-connected component of equal labels that has fewer than `most`, in the order of their first
/// cells. Row by row, `width` cells a row; cells labelled 0 belong to none.
pub(crate) fn connected_components(
    mut labels: Vec<u8>,
    width: usize,
    most: usize,
    each: &mut dyn FnMut(&[u32]),
) -> Result<()> {
    // The cells of a component, and those beyond which its neighbours have not been looked at.
    let mut component: Vec<u32> = Vec::new();
    for first in 0..labels.len() {
        // A cell that has been reached loses its label.
        let label = std::mem::take(&mut labels[first]);
        if label == 0 {
            continue;
        }
        component.clear();
        reserve_more(&mut component, 1)?;
        component.push(first as u32);
        let (mut next, mut large) = (0, false);
        while let Some(&at) = component.get(next) {
            reserve_more(&mut component, 4)?;
            for other in neighbours(at as usize, width) {
                if labels.get(other) == Some(&label) {
                    labels[other] = 0;
                    component.push(other as u32);
                }
            }
            next += 1;
            // Of a large one, which can be most of the canvas, only the front is kept.
            if component.len() >= most.max(FRONT) && 2 * next >= component.len() {
                component.drain(..next);
                (next, large) = (0, true);
            }
        }
        if !large && component.len() < most {
            each(&component);
        }
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
