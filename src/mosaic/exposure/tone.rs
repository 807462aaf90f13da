//! The inverse of sRGB's transfer function as a table.

use crate::Result;
use crate::image::zeroed;

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

/// The level of this much light, by such a table; that of white for more.
pub(super) fn level_of(light: f64, levels: &[u8]) -> u8 {
    // The conversion saturates.
    levels[((light * (STEPS - 1) as f64 + 0.5) as usize).min(STEPS - 1)]
}
