//! A ramp across the seam.

use super::canvas::Placed;
use super::distance::{UNIT, distance};
use super::span::Span;
use crate::{Image, Mask, Result};

/// Blends the reference into `image`, which holds the target: half of either at the seam, one alone from half of `ramp`
/// pixels away from it. Towards a border of either photo its share fades, so that no border shows.
pub(super) fn blend(
    image: &mut Image,
    reference: &Placed<'_>,
    seam: &Mask,
    ramp: u32,
    span: &mut Span<'_>,
) -> Result<()> {
    let (width, height) = (image.width, image.height);
    let pixels = image.data.as_chunks_mut::<4>().0;
    span.row(0, 3)?;
    let to_target = distance(width, height, false, &|i| seam.data[i] == 1)?;
    span.part(0.25, 1.0).row(0, 1)?;
    let to_reference = distance(width, height, false, &|i| seam.data[i] == 2)?;
    span.part(0.5, 1.0).row(0, 1)?;
    let inside = distance(width, height, true, &|i| pixels[i][3] == 0)?;
    let mut span = span.part(0.75, 1.0);
    let half = ramp as f32 * f32::from(UNIT) / 2.0;
    // From the middle between two pixels on either side of the seam.
    let share = |distance: f32| ((distance - f32::from(UNIT) / 2.0) / half.max(1.0)).min(1.0);
    let (columns, rows) = (reference.photo.width(), reference.photo.height());
    for y in 0..height {
        span.row(y, height)?;
        let Some(photo) = reference.row(y) else { continue };
        for (x, &[r, g, b, _]) in photo.iter().enumerate() {
            let i = y * width + reference.left + x;
            let pixel = &mut pixels[i];
            if pixel[3] == 0 {
                *pixel = [r, g, b, 255];
                continue;
            }
            let from_seam = match to_target[i] {
                0 => share(f32::from(to_reference[i])),
                distance => -share(f32::from(distance)),
            };
            let [top, bottom] = [y - reference.top + 1, rows + reference.top - y];
            let edge = (x + 1).min(columns - x).min(top).min(bottom);
            let most = share(f32::from(inside[i]));
            let least = 1.0 - share(edge as f32 * f32::from(UNIT));
            let target = (0.5 + 0.5 * from_seam).min(most).max(least.min(most));
            for (own, other) in pixel.iter_mut().zip([r, g, b]) {
                let other = f32::from(other);
                *own = (other + (f32::from(*own) - other) * target + 0.5) as u8;
            }
        }
    }
    Ok(())
}
