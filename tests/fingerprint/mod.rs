//! One number for many, by which runs on different machines are compared.

/// FNV-1a, 64 bit, of bytes; of larger numbers in the same way.
pub fn fingerprint(values: impl IntoIterator<Item = u64>) -> u64 {
    values.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, value| (hash ^ value).wrapping_mul(0x100_0000_01b3))
}
