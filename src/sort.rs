//! Sorting of indices.

use std::cmp::Ordering;

/// Sorts indices by a total order. Each closure type that the standard library's sort is compiled for adds some four kilobytes
/// to the wasm module, gzipped: this is the one.
pub(crate) fn sort_indices(indices: &mut [u32], order: &dyn Fn(u32, u32) -> Ordering) {
    indices.sort_unstable_by(|&a, &b| order(a, b));
}
