//! Loops over the rows of a photo.

use std::ops::Range;

use crate::Result;

/// Calls `work` for one row after the other. It stays a function of its own, which is why see [`crate::rows`].
#[inline(never)]
pub(crate) fn for_each_row(mut rows: Range<usize>, work: &mut dyn FnMut(usize) -> Result<()>) -> Result<()> {
    rows.try_for_each(work)
}
