//! Steps of colour that stand out from what lies beside them, along the seam and elsewhere.

use super::lab::Lab;
use super::seam::crosses;
use super::share;
use crate::image::check_size;
use crate::sort::sort_indices;
use crate::{ImageView, Mask, Result};
use std::ops::Range;

/// Pixels on either side whose means are compared.
const MEAN: usize = 5;
/// How far beside the seam the steps that it is compared with lie.
const REACH: usize = 40;
/// By how much a visible step exceeds them, in CIELAB.
const MARGIN: f32 = 3.0;
/// A place with fewer steps beside it is not judged.
const FEW: usize = 20;

/// Away from the seam every so many lines and places are judged.
const EVERY: usize = 16;

/// How much of a mosaic has steps that stand out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleSteps {
    /// Share of the seam. `None` when no more than 20 places can be judged.
    pub seam: Option<f64>,
    /// Share of all other places, where one photo shows on either side: what edges of the scene alone amount to. `None` as before.
    pub elsewhere: Option<f64>,
}

/// Shares of a mosaic with a step that is larger than the 90th percentile of those beside it by more than 3 in CIELAB. A step
/// is the difference of the means of five pixels on either side, across the seam or, elsewhere, of a row or column; `seam` says
/// which photo shows, 0 for none.
///
/// # Errors
/// `size-mismatch` for a seam of another size than the mosaic.
pub fn visible_steps(mosaic: ImageView<'_>, seam: &Mask) -> Result<VisibleSteps> {
    check_size("seam", seam.size(), mosaic.size())?;
    let lab = Lab::new();
    let (width, height) = seam.size();
    let pixels = mosaic.pixels();
    let [mut at_seam, mut elsewhere] = [Tally::default(); 2];
    for (lines, length, step, next) in [(height, width, 1, width), (width, height, width, 1)] {
        for line in 0..lines {
            let at = |i: usize| line * next + i * step;
            let label = |i: usize| seam.data()[at(i)];
            let pixel = |i: usize| pixels[at(i)];
            for i in 1..length {
                if crosses(label(i - 1), label(i)) {
                    at_seam.add(stands_out(&lab, &pixel, length, i));
                } else if line % EVERY == 0 && i % EVERY == 0 && window(i, length).all(|j| label(j) == label(i)) {
                    elsewhere.add(stands_out(&lab, &pixel, length, i));
                }
            }
        }
    }
    Ok(VisibleSteps { seam: at_seam.share(), elsewhere: elsewhere.share() })
}

#[derive(Clone, Copy, Default)]
struct Tally {
    judged: usize,
    visible: usize,
}

impl Tally {
    fn add(&mut self, stands_out: Option<bool>) {
        self.judged += usize::from(stands_out.is_some());
        self.visible += usize::from(stands_out == Some(true));
    }

    fn share(&self) -> Option<f64> {
        (self.judged > FEW).then(|| share(self.visible, self.judged))
    }
}

/// The pixels of a line that a step between the pixels `place` − 1 and `place` is judged by.
fn window(place: usize, length: usize) -> Range<usize> {
    let middle = place.saturating_sub(MEAN);
    middle.saturating_sub(REACH)..(middle + REACH + 2 * MEAN - 1).min(length)
}

/// Whether the step between the pixels `place` − 1 and `place` of a line stands out; `None` where that cannot be said.
fn stands_out(lab: &Lab, pixel: &dyn Fn(usize) -> [u8; 4], length: usize, place: usize) -> Option<bool> {
    // Step k lies between the pixels first + k + MEAN − 1 and first + k + MEAN.
    let middle = place.checked_sub(MEAN)?;
    let Range { start: first, end: last } = window(place, length);
    if place + MEAN > length {
        return None;
    }
    // Sums of the colours and of the valid pixels up to each.
    let mut sums = [[0.0f32; 4]; 2 * (REACH + MEAN)];
    let mut sum = [0.0; 4];
    for (entry, i) in sums[1..].iter_mut().zip(first..last) {
        let pixel = pixel(i);
        if pixel[3] != 0 {
            let colour = lab.of(pixel);
            sum = [sum[0] + colour[0], sum[1] + colour[1], sum[2] + colour[2], sum[3] + 1.0];
        }
        *entry = sum;
    }
    let step = |k: usize| {
        let [a, b, c] = [sums[k], sums[k + MEAN], sums[k + 2 * MEAN]];
        let difference = |i: usize| ((c[i] - b[i]) - (b[i] - a[i])) / MEAN as f32;
        let squares = [0, 1, 2].map(|i| difference(i) * difference(i));
        (c[3] - a[3] == (2 * MEAN) as f32).then(|| (squares[0] + squares[1] + squares[2]).sqrt())
    };
    let middle = middle - first;
    let own = step(middle)?;
    let mut beside = [0.0; 2 * REACH];
    let mut count = 0;
    for k in
        (0..(last - first + 1).saturating_sub(2 * MEAN)).filter(|k| k + 2 * MEAN < middle || *k >= middle + 2 * MEAN)
    {
        if let Some(step) = step(k) {
            beside[count] = step;
            count += 1;
        }
    }
    (count >= FEW).then(|| own > percentile_90(&beside[..count]) + MARGIN)
}

/// Linear between the two nearest ranks.
fn percentile_90(values: &[f32]) -> f32 {
    let mut order: [u32; 2 * REACH] = std::array::from_fn(|i| i as u32);
    let order = &mut order[..values.len()];
    sort_indices(order, &|a, b| values[a as usize].total_cmp(&values[b as usize]));
    let rank = 0.9 * (values.len() - 1) as f32;
    let at = |i: usize| values[order[i.min(values.len() - 1)] as usize];
    let (below, above) = (at(rank as usize), at(rank as usize + 1));
    below + (above - below) * (rank - (rank as usize) as f32)
}
