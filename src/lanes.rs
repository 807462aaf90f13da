//! 128-bit vectors, those of SSE2, NEON and wasm's SIMD: how many values they hold, and rows of floats.

use wide::f32x4;

/// 32-bit numbers.
pub(crate) const LANES: usize = 4;
/// Bytes.
pub(crate) const BYTE_LANES: usize = 16;

/// Four floats from any place of a row; zeros past its end.
#[inline(always)]
pub(crate) fn load(row: &[f32], at: usize) -> f32x4 {
    row.get(at..).and_then(|rest| rest.first_chunk::<LANES>()).map_or(f32x4::ZERO, |four| f32x4::from(*four))
}

/// sums += weight · values.
pub(crate) fn add_weighted(sums: &mut [f32], values: &[f32], weight: f32) {
    let ((sums, last), (values, rest)) = (sums.as_chunks_mut(), values.as_chunks());
    for (sum, &value) in sums.iter_mut().zip(values) {
        *sum = (f32x4::new(*sum) + f32x4::splat(weight) * f32x4::new(value)).to_array();
    }
    last.iter_mut().zip(rest).for_each(|(sum, value)| *sum += weight * value);
}
