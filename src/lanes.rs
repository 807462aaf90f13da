//! How many values the 128-bit vectors of SSE2, NEON and wasm's SIMD hold.

/// 32-bit numbers.
pub(crate) const LANES: usize = 4;
/// Bytes.
pub(crate) const BYTE_LANES: usize = 16;
