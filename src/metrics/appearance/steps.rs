//! Steps of colour along the seam that stand out from what lies beside it.

use super::lab::Lab;
use super::seam::crosses;
use super::share;
use crate::sort::sort_indices;
use crate::{ImageView, Mask};

/// Pixels on either side whose means are compared.
const MEAN: usize = 5;
/// How far beside the seam the steps that it is compared with lie.
const REACH: usize = 40;
/// By how much a visible step exceeds them, in CIELAB.
const MARGIN: f32 = 3.0;
/// A place with fewer steps beside it is not judged.
const FEW: usize = 20;

/// Share of the seam with a step that is larger than the 90th percentile of those beside it by more than 3 in CIELAB. A step
/// is the difference of the means of five pixels on either side, across the seam; `seam` says which photo shows, 0 for
/// none. Both have the same size. `None` when no more than 20 places can be judged.
pub fn visible_steps(mosaic: ImageView<'_>, seam: &Mask) -> Option<f64> {
    let lab = Lab::new();
    let (width, height) = seam.size();
    let pixels = mosaic.pixels();
    let (mut judged, mut visible) = (0, 0);
    for (lines, length, step, next) in [(height, width, 1, width), (width, height, width, 1)] {
        for line in 0..lines {
            let at = |i: usize| line * next + i * step;
            for i in 0..length - 1 {
                if crosses(seam.data()[at(i)], seam.data()[at(i + 1)]) {
                    let pixel = |i: usize| pixels[at(i)];
                    if let Some(stands_out) = stands_out(&lab, &pixel, length, i + 1) {
                        (judged, visible) = (judged + 1, visible + usize::from(stands_out));
                    }
                }
            }
        }
    }
    (judged > FEW).then(|| share(visible, judged))
}

/// Whether the step between the pixels `seam` − 1 and `seam` of a line stands out; `None` where that cannot be said.
fn stands_out(lab: &Lab, pixel: &dyn Fn(usize) -> [u8; 4], length: usize, seam: usize) -> Option<bool> {
    // Step k lies between the pixels first + k + MEAN − 1 and first + k + MEAN.
    let middle = seam.checked_sub(MEAN)?;
    let (first, last) = (middle.saturating_sub(REACH), (middle + REACH + 2 * MEAN - 1).min(length));
    if seam + MEAN > length {
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
