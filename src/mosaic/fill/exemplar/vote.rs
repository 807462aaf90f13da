//! Colours of the voids from the patches found.

use super::level::{BEFORE, Level, SIDE};
use super::search::Source;

/// Gives every void the weighted mean of the source patches that overlap it.
pub(super) fn vote(level: &mut Level, sources: &[Source]) {
    for number in 0..level.voids.len() {
        vote_on(level, sources, number);
    }
}

/// The same for one void. Only known pixels are copied, so no order matters.
pub(super) fn vote_on(level: &mut Level, sources: &[Source], number: usize) {
    let cell = level.voids[number].cell;
    let mut sum = [0.0f32; 4];
    let first = |at: usize| (at + BEFORE) % level.stride;
    let (first_column, first_row) = (first(cell % level.width), first(cell / level.width));
    let corner = BEFORE * (level.width + 1);
    for row in (first_row..SIDE).step_by(level.stride) {
        for column in (first_column..SIDE).step_by(level.stride) {
            // The patch that has this pixel at (column, row).
            let back = row * level.width + column;
            let patch = level.index[cell + corner - back] as usize;
            let Some(source) = sources.get(patch.wrapping_sub(1)) else { continue };
            let [r, g, b, _] = level.colour[source.cell + back - corner];
            for (sum, v) in sum.iter_mut().zip([f32::from(r), f32::from(g), f32::from(b), 1.0]) {
                *sum += source.weight * v;
            }
        }
    }
    if sum[3] > 0.0 {
        let [r, g, b, _] = sum.map(|v| (v / sum[3] + 0.5) as u8);
        level.colour[cell] = [r, g, b, 0];
    }
}
