//! Connected components of a grid.

use crate::Result;
use crate::image::reserve_more;

/// Calls `each` with the cells of every 4-connected component of equal labels that has fewer than `most`, in the order of their first
/// cells. Row by row, `width` cells a row; cells labelled 0 belong to none.
pub(crate) fn connected_components(
    mut labels: Vec<u8>,
    width: usize,
    most: usize,
    each: &mut dyn FnMut(&[u32]),
) -> Result<()> {
    // The cells of a component, and cells from which it goes on.
    let (mut component, mut open): (Vec<u32>, Vec<u32>) = Default::default();
    for first in 0..labels.len() {
        let label = labels[first];
        if label == 0 {
            continue;
        }
        component.clear();
        reserve_more(&mut open, 1)?;
        open.push(first as u32);
        while let Some(at) = open.pop() {
            let at = at as usize;
            // A cell that has been reached loses its label.
            if labels[at] != label {
                continue;
            }
            // All that hangs together with it in its row.
            let (before, behind) = (&labels[at - at % width..at], &labels[at..at - at % width + width]);
            let alike = |&&other: &&u8| other == label;
            let run = at - before.iter().rev().take_while(alike).count()..at + behind.iter().take_while(alike).count();
            labels[run.clone()].fill(0);
            // Of a large one, which can be most of the canvas, the cells are not kept.
            if component.len() < most {
                reserve_more(&mut component, run.len())?;
                component.extend(run.start as u32..run.end as u32);
            }
            for start in [run.start.checked_sub(width), Some(run.start + width)].into_iter().flatten() {
                let mut last = 0;
                for (at, &other) in (start..).zip(labels.get(start..start + run.len()).unwrap_or_default()) {
                    if other == label && last != label {
                        reserve_more(&mut open, 1)?;
                        open.push(at as u32);
                    }
                    last = other;
                }
            }
        }
        if component.len() < most {
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
