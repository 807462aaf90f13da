//! The one sort of the core.

use crate::Result;
use crate::image::reserve;

/// The indices 0 to `len` − 1 sorted by a total order; of those that are equal to each other only one is left.
pub(crate) fn sorted(len: usize, less: &dyn Fn(u32, u32) -> bool) -> Result<Vec<u32>> {
    let mut all = Vec::new();
    reserve(&mut all, len)?;
    all.extend(0..len as u32);
    sort(&mut all, less);
    let mut kept = 0;
    for i in 0..len {
        if kept == 0 || less(all[kept - 1], all[i]) {
            all[kept] = all[i];
            kept += 1;
        }
    }
    all.truncate(kept);
    Ok(all)
}

/// Heapsort by a total order. The standard library's sorts would each be several kilobytes of wasm.
#[inline(never)]
pub(crate) fn sort(indices: &mut [u32], less: &dyn Fn(u32, u32) -> bool) {
    let sift = |heap: &mut [u32], mut parent: usize| {
        loop {
            let mut child = 2 * parent + 1;
            if child >= heap.len() {
                break;
            }
            if child + 1 < heap.len() && less(heap[child], heap[child + 1]) {
                child += 1;
            }
            if !less(heap[parent], heap[child]) {
                break;
            }
            heap.swap(parent, child);
            parent = child;
        }
    };
    for parent in (0..indices.len() / 2).rev() {
        sift(indices, parent);
    }
    for end in (1..indices.len()).rev() {
        indices.swap(0, end);
        sift(&mut indices[..end], 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorts() {
        for n in 0..70u32 {
            let value = |i: u32| (i * 37 + 11) % 29;
            let mut indices: Vec<u32> = (0..n).collect();
            sort(&mut indices, &|a, b| (value(a), a) < (value(b), b));
            let mut expected: Vec<u32> = (0..n).collect();
            expected.sort_by_key(|&i| (value(i), i));
            assert_eq!(indices, expected);
            let unique = sorted(n as usize, &|a, b| value(a) < value(b));
            let mut values: Vec<u32> = expected.into_iter().map(value).collect();
            values.dedup();
            assert_eq!(unique.map(|indices| indices.into_iter().map(value).collect()), Ok(values));
        }
    }
}
