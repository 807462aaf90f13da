//! Sorting of indices.

use std::cmp::Ordering;

/// Sorts indices by a total order, by heapsort (R. W. Floyd, *Treesort 3*, 1964): the standard library's sort adds 2 KB to the
/// wasm module, gzipped.
pub(crate) fn sort_indices(indices: &mut [u32], order: &dyn Fn(u32, u32) -> Ordering) {
    for root in (0..indices.len() / 2).rev() {
        sift_down(indices, root, order);
    }
    for end in (1..indices.len()).rev() {
        indices.swap(0, end);
        sift_down(&mut indices[..end], 0, order);
    }
}

/// Lets an index sink until none below it in the heap comes after it.
fn sift_down(heap: &mut [u32], root: usize, order: &dyn Fn(u32, u32) -> Ordering) {
    let mut parent = root;
    while let Some(&left) = heap.get(2 * parent + 1) {
        let right = heap.get(2 * parent + 2).filter(|&&right| order(left, right).is_lt());
        let child = 2 * parent + 1 + usize::from(right.is_some());
        if order(heap[parent], heap[child]).is_ge() {
            break;
        }
        heap.swap(parent, child);
        parent = child;
    }
}
