//! sRGB's transfer function as tables.

use crate::Result;
use crate::image::zeroed;

/// Linear light, 0 to 1, of every 8 bit level (IEC 61966-2-1).
pub(crate) fn linear_light() -> [f32; 256] {
    std::array::from_fn(|level| {
        let v = level as f64 / 255.0;
        (if v <= 0.04045 { v / 12.92 } else { libm::exp(2.4 * libm::log((v + 0.055) / 1.055)) }) as f32
    })
}

/// Entries of the inverse table: in the dark, where the curve is steepest, five to a level.
pub(super) const STEPS: usize = 1 << 14;

/// The 8 bit level of linear light k / ([`STEPS`] − 1).
pub(super) fn levels(linear: &[f32; 256]) -> Result<Vec<u8>> {
    let mut table = zeroed(STEPS)?;
    let mut level = 0usize;
    for (k, entry) in table.iter_mut().enumerate() {
        let light = k as f32 / (STEPS - 1) as f32;
        // Nearest in light rather than in level: the curve is almost straight between two levels.
        while level < 255 && light - linear[level] > linear[level + 1] - light {
            level += 1;
        }
        *entry = level as u8;
    }
    Ok(table)
}
