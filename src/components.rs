//! Connected components of a grid.

use std::ops::Range;

use crate::Result;
use crate::image::reserve_more;

/// Calls `each` with every 4-connected component of equal labels that has fewer cells than `most`, in the order of their first cells: its
/// spans, each of cells next to each other in a row. Row by row, `width` cells a row; cells labelled 0 belong to none.
pub(crate) fn connected_components(
    mut labels: Vec<u8>,
    width: usize,
    most: usize,
    each: &mut dyn FnMut(&[Range<usize>]),
) -> Result<()> {
    // The spans of a component, unless it is too large, and those of which the rows above and below have not been looked at.
    let (mut component, mut open) = (Vec::new(), Vec::new());
    for first in 0..labels.len() {
        let label = labels[first];
        if label == 0 {
            continue;
        }
        let mut cells = 0;
        component.clear();
        reserve_more(&mut open, 1)?;
        open.push(take_span(&mut labels, width, first));
        while let Some(span) = open.pop() {
            cells += span.len();
            take_neighbours(&mut labels, width, (&span, label), &mut open)?;
            if cells < most {
                reserve_more(&mut component, 1)?;
                component.push(span);
            }
        }
        if cells < most {
            each(&component);
        }
    }
    Ok(())
}

/// Takes the spans with the same label that touch one from above or below.
#[inline(never)] // see `crate::rows`
fn take_neighbours(
    labels: &mut [u8],
    width: usize,
    (span, label): (&Range<usize>, u8),
    open: &mut Vec<Range<usize>>,
) -> Result<()> {
    let above = span.start.checked_sub(width).map(|start| start..start + span.len());
    let below = Some(span.start + width..span.end + width).filter(|below| below.end <= labels.len());
    for beside in above.into_iter().chain(below) {
        let mut at = beside.start;
        while at < beside.end {
            if labels[at] == label {
                let next = take_span(labels, width, at);
                at = next.end;
                reserve_more(open, 1)?;
                open.push(next);
            }
            at += 1; // behind a span is another label
        }
    }
    Ok(())
}

/// The cells with the same label next to each other in a row, `at` among them. They lose it.
fn take_span(labels: &mut [u8], width: usize, at: usize) -> Range<usize> {
    let (label, row) = (labels[at], at / width * width);
    let (mut start, mut end) = (at, at + 1);
    while start > row && labels[start - 1] == label {
        start -= 1;
    }
    while end < row + width && labels[end] == label {
        end += 1;
    }
    labels[start..end].fill(0);
    start..end
}

/// The cells to the left, to the right, above and below; where there is none, a number that is no cell's.
pub(crate) fn neighbours(at: usize, width: usize) -> [usize; 4] {
    let x = at % width;
    let left = if x > 0 { at - 1 } else { usize::MAX };
    let right = if x + 1 < width { at + 1 } else { usize::MAX };
    [left, right, at.wrapping_sub(width), at + width]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    fn components(rows: &[&str], most: usize) -> Vec<Vec<usize>> {
        let labels = rows.concat().bytes().map(|label| label - b'0').collect();
        let mut found = Vec::new();
        connected_components(labels, rows[0].len(), most, &mut |spans| {
            let mut cells: Vec<usize> = spans.iter().cloned().flatten().collect();
            cells.sort_unstable();
            found.push(cells);
        })
        .unwrap();
        found
    }

    #[test]
    fn what_hangs_together_is_one_component() {
        let rows = ["1010", "1112", "0012", "1100"];
        let first = vec![0, 2, 4, 5, 6, 10];
        assert_eq!(components(&rows, 100), [first, vec![7, 11], vec![12, 13]]);
    }

    #[test]
    fn large_components_are_left_out() {
        assert_eq!(components(&["1010", "1112", "0012", "1100"], 6), [[7, 11], [12, 13]]);
    }

    #[test]
    fn a_row_ends_at_its_end() {
        assert_eq!(components(&["001", "100"], 100), [[2], [3]]);
    }
}
