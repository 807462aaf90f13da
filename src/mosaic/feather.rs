//! A ramp across the seam.

use super::canvas::Placed;
use super::seam::{REFERENCE, TARGET};
use crate::distance::{STRAIGHT, distance, to_outside};
use crate::observer::{Observer, Portion, report, report_row};
use crate::{Image, Mask, Result, Stage};

/// Blends the reference into `image`, which holds the target: half of either at the seam, one alone from half of `ramp`
/// pixels away from it. Towards a border of either photo its share fades, so that no border shows.
pub(super) fn blend(
    image: &mut Image,
    reference: &Placed<'_>,
    seam: &Mask,
    ramp: u32,
    observer: &mut dyn Observer,
) -> Result<()> {
    let (width, height) = image.size();
    let pixels = image.pixels_mut();
    report(observer, Stage::Blend, 0.0)?;
    let to_target = distance(pixels.len(), width, &|i| seam.data()[i] == TARGET)?;
    report(observer, Stage::Blend, 0.25)?;
    let to_reference = distance(pixels.len(), width, &|i| seam.data()[i] == REFERENCE)?;
    report(observer, Stage::Blend, 0.5)?;
    let inside = distance(pixels.len(), width, &|i| pixels[i][3] == 0)?;
    let observer = &mut Portion::new(observer, 0.75, 1.0);
    let half = (ramp * STRAIGHT) as f32 / 2.0;
    // From the middle between two pixels on either side of the seam.
    let share = |distance: u32| ((distance as f32 - STRAIGHT as f32 / 2.0) / half.max(1.0)).min(1.0);
    let own = reference.border_distance((width, height))?;
    for y in 0..height {
        report_row(observer, Stage::Blend, y, height)?;
        let Some(photo) = reference.row(y) else { continue };
        for (x, &[r, g, b, _]) in photo.iter().enumerate().filter(|(_, pixel)| reference.is_valid(**pixel)) {
            let i = y * width + reference.left + x;
            let pixel = &mut pixels[i];
            if pixel[3] == 0 {
                *pixel = [r, g, b, 255];
                continue;
            }
            let from_seam = match to_target[i] {
                0 => share(to_reference[i].into()),
                distance => -share(distance.into()),
            };
            let at = (reference.left + x, y);
            let most = share(u32::from(inside[i]).min(to_outside(at, (width, height))));
            let least = 1.0 - share(own.at(at));
            let target = (0.5 + 0.5 * from_seam).min(most).max(least.min(most));
            for (own, other) in pixel.iter_mut().zip([r, g, b]) {
                let other = f32::from(other);
                *own = (other + (f32::from(*own) - other) * target + 0.5) as u8;
            }
        }
    }
    Ok(())
}
