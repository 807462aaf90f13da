//! sRGB: its transfer function, and the levels that can be trusted.

/// Levels outside of which a pixel may be clipped, or too dark to tell how much light it took.
pub(crate) const USABLE: [u8; 2] = [6, 249];

/// Linear light, 0 to 1, of every 8 bit level (IEC 61966-2-1).
pub(crate) fn linear_light() -> [f32; 256] {
    std::array::from_fn(|level| {
        let v = level as f64 / 255.0;
        (if v <= 0.04045 { v / 12.92 } else { libm::exp(2.4 * libm::log((v + 0.055) / 1.055)) }) as f32
    })
}
