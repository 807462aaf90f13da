//! Distance to a set of pixels.

use crate::Result;
use crate::image::reserve;

/// What a step to the next pixel counts.
pub(super) const UNIT: u16 = 5;
const DIAGONAL: u16 = 7;

/// Distance of every pixel to the nearest one of which `inside` is true or that lies beyond the frame, if `framed`: in
/// [`UNIT`]s, by the 5-7 chamfer (within 8 % of the Euclidean one), at most 65535.
pub(super) fn distance(width: usize, height: usize, framed: bool, inside: &dyn Fn(usize) -> bool) -> Result<Vec<u16>> {
    let mut field = Vec::new();
    reserve(&mut field, width * height)?;
    field.extend((0..width * height).map(|i| if inside(i) { 0 } else { u16::MAX }));
    let beyond = if framed { UNIT } else { u16::MAX };
    // Down and to the right, then back: the same sweep of the field read backwards.
    for backwards in [false, true] {
        let place = |x: usize, y: usize| {
            let i = y * width + x;
            if backwards { width * height - 1 - i } else { i }
        };
        for y in 0..height {
            for x in 0..width {
                let mut least = field[place(x, y)];
                let mut near = |there: bool, x: usize, y: usize, step: u16| {
                    let through = if there { field[place(x, y)].saturating_add(step) } else { beyond };
                    least = least.min(through);
                };
                near(x > 0, x.wrapping_sub(1), y, UNIT);
                near(y > 0, x, y.wrapping_sub(1), UNIT);
                near(x > 0 && y > 0, x.wrapping_sub(1), y.wrapping_sub(1), DIAGONAL);
                near(x + 1 < width && y > 0, x + 1, y.wrapping_sub(1), DIAGONAL);
                field[place(x, y)] = least;
            }
        }
    }
    Ok(field)
}
