//! Joins what was filled to its surroundings without a step.

use super::level::Level;
use crate::Result;
use crate::image::{reserve, zeroed};

/// Colours on both sides of a void's border that differ by more levels are different things.
const STEP: f32 = 32.0;
/// Most sweeps.
const SWEEPS: usize = 200;

/// Adds a membrane to the colours of the voids: a smooth surface through the differences of colour at their border to the background
/// (P. Pérez, M. Gangnet, A. Blake, *Poisson Image Editing*, 2003), free where the differences are large or something is
/// in front. `half_width` is that of the widest void, in cells.
pub(super) fn match_border(level: &mut Level, half_width: usize) -> Result<()> {
    let steps = [1, level.width];
    // By void: sums of the differences of red, green and blue, and how many there are.
    let mut differences: Vec<[f32; 4]> = Vec::new();
    reserve(&mut differences, level.voids.len())?;
    for void in &level.voids {
        let own = level.colour[void.cell];
        let mut sum = [0.0; 4];
        for at in steps.into_iter().flat_map(|step| [void.cell - step, void.cell + step]) {
            if level.index[at] == 0 && level.seen[at] != 0 {
                let apart = [0, 1, 2].map(|c| f32::from(level.colour[at][c]) - f32::from(own[c]));
                if apart.iter().all(|apart| apart.abs() <= STEP) {
                    (0..3).for_each(|c| sum[c] += apart[c]);
                    sum[3] += 1.0;
                }
            }
        }
        differences.push(sum);
    }
    if differences.iter().all(|sum| sum[3] == 0.0) {
        return Ok(());
    }
    // Successive over-relaxation, with the best factor for a void that is as wide.
    let across = 2 * half_width.max(1);
    let factor = (2.0 / (1.0 + libm::sin(std::f64::consts::PI / across as f64))) as f32;
    let mut membrane: Vec<[f32; 3]> = zeroed(level.voids.len())?;
    for sweep in 0..across.min(SWEEPS) {
        for i in 0..membrane.len() {
            let i = if sweep % 2 == 0 { i } else { membrane.len() - 1 - i };
            let cell = level.voids[i].cell;
            let mut sum = differences[i];
            for at in steps.into_iter().flat_map(|step| [cell - step, cell + step]) {
                if let Some(other) = membrane.get((level.index[at] as usize).wrapping_sub(1)) {
                    (0..3).for_each(|c| sum[c] += other[c]);
                    sum[3] += 1.0;
                }
            }
            if sum[3] > 0.0 {
                (0..3).for_each(|c| membrane[i][c] += factor * (sum[c] / sum[3] - membrane[i][c]));
            }
        }
    }
    for (void, offset) in level.voids.iter().zip(&membrane) {
        let colour = &mut level.colour[void.cell];
        // The conversion saturates.
        (0..3).for_each(|c| colour[c] = (f32::from(colour[c]) + offset[c] + 0.5) as u8);
    }
    Ok(())
}
