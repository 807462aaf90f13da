//! Gains from samples.

use super::samples::Sample;
use crate::Result;
use crate::geometry::statistics::median;
use crate::image::zeroed;

/// Samples below which nothing is said about exposure.
const FEWEST: usize = 12;
/// Gains farther from 1 than this factor are no exposure difference.
const LARGEST: f64 = 8.0;
/// Rounds of re-weighting.
const ROUNDS: usize = 8;
/// Spread of the logarithms of the ratios that is never taken for misalignment.
const LEAST_SPREAD: f64 = 0.02;

/// Variance of the logarithm of light that is not enough to see a slope.
const LEAST_CONTRAST: f64 = 0.02;
/// Slopes beyond this are no difference between cameras.
const STEEPEST: f64 = 0.4;

/// Nodes of the gain field along the canvas' longer side.
const NODES: usize = 16;
/// Sweeps over the field.
const SWEEPS: usize = 60;
/// Pull of a node's neighbours on it, in samples.
const STIFFNESS: f64 = 4.0;
/// Pull of the common gain on a node, in samples.
const DAMPING: f64 = 0.3;

/// What the target's light is multiplied by.
pub(super) struct Response {
    /// On average over the overlap.
    pub gains: [f64; 3],
    pub curves: [Curve; 3],
    pub field: Field,
}

/// How much more the brighter is multiplied than the darker: what is left of a difference in gamma.
#[derive(Clone, Copy, Default)]
pub(super) struct Curve {
    /// The logarithm of the gain changes by this much per unit of the logarithm of light.
    pub slope: f64,
    /// Logarithm of the light at which the curve does nothing.
    pub pivot: f64,
}

/// Gains on a coarse grid over the canvas, bilinear between its nodes.
pub(super) struct Field {
    /// Row by row: red, green, blue, 0.
    pub nodes: Vec<[f32; 4]>,
    pub columns: usize,
    pub rows: usize,
    /// Pixels from node to node; the first is at pixel 0.
    pub step: usize,
}

/// The gains that carry the target's light into the reference's; `None` when there is too little to go by.
///
/// The logarithm of the ratio is a constant per channel and, with `vary`, a slope over the logarithm of light and a field with
/// little bending; samples that do not fit (something moved, or is misaligned) lose their weight (Tukey's biweight).
pub(super) fn fit(samples: &[Sample], size: (usize, usize), vary: bool) -> Result<Option<Response>> {
    if samples.len() < FEWEST {
        return Ok(None);
    }
    let step = size.0.max(size.1).div_ceil(NODES).max(1);
    let (columns, rows) = (size.0.div_ceil(step) + 1, size.1.div_ceil(step) + 1);
    let mut nodes: Vec<[f32; 4]> = zeroed(columns * rows)?;
    let (mut gains, mut curves) = ([1.0; 3], [Curve::default(); 3]);
    let mut lights: Vec<f64> = zeroed(samples.len())?;
    let mut ratios: Vec<f64> = zeroed(samples.len())?;
    let mut residuals: Vec<f64> = zeroed(samples.len())?;
    let mut weights: Vec<f64> = zeroed(samples.len())?;
    let mut data: Vec<[f64; 2]> = zeroed(columns * rows)?;
    for c in 0..3 {
        for ((light, ratio), sample) in lights.iter_mut().zip(&mut ratios).zip(samples) {
            *light = libm::log(sample.target[c]);
            *ratio = libm::log(sample.reference[c]) - *light;
        }
        let mut curve = Curve::default();
        let mut common = median(ratios.clone()).unwrap_or(0.0);
        let mut field: Vec<f64> = zeroed(columns * rows)?;
        for _ in 0..ROUNDS {
            for (((residual, sample), ratio), light) in residuals.iter_mut().zip(samples).zip(&ratios).zip(&lights) {
                *residual = ratio - common - curve.slope * (light - curve.pivot);
                for (node, share) in corners(sample.place, step, columns, rows) {
                    *residual -= share * field[node];
                }
            }
            weigh(&residuals, samples, &mut weights);
            let (mut sum, mut light_sum, mut total) = (0.0, 0.0, f64::MIN_POSITIVE);
            for ((weight, ratio), light) in weights.iter().zip(&ratios).zip(&lights) {
                (sum, light_sum, total) = (sum + weight * ratio, light_sum + weight * light, total + weight);
            }
            common = sum / total;
            if vary {
                let before = curve;
                curve.pivot = light_sum / total;
                let (mut product, mut square) = (0.0, LEAST_CONTRAST * total);
                for ((residual, weight), light) in residuals.iter().zip(&weights).zip(&lights) {
                    let contrast = light - curve.pivot;
                    product += weight * contrast * (residual + before.slope * contrast);
                    square += weight * contrast * contrast;
                }
                curve.slope = (product / square).clamp(-STEEPEST, STEEPEST);
                data.fill([0.0; 2]);
                for (((sample, weight), ratio), light) in samples.iter().zip(&weights).zip(&ratios).zip(&lights) {
                    let local = ratio - common - curve.slope * (light - curve.pivot);
                    for (node, share) in corners(sample.place, step, columns, rows) {
                        data[node][0] += weight * share;
                        data[node][1] += weight * share * local;
                    }
                }
                relax(&mut field, &data, columns, rows);
            }
        }
        curves[c] = curve;
        // What the fit makes of the light of all samples: those that do not fit are light, too.
        let (mut before, mut after) = (f64::MIN_POSITIVE, 0.0);
        for ((sample, ratio), residual) in samples.iter().zip(&ratios).zip(&residuals) {
            let light = sample.target[c];
            (before, after) = (before + light, after + light * libm::exp(ratio - residual));
        }
        gains[c] = after / before;
        for (node, local) in nodes.iter_mut().zip(&field) {
            node[c] = libm::exp((common + local).clamp(-2.0, 2.0)) as f32;
        }
    }
    let sane = gains.iter().all(|gain| *gain > 1.0 / LARGEST && *gain < LARGEST);
    Ok(sane.then_some(Response { gains, curves, field: Field { nodes, columns, rows, step } }))
}

/// Tukey's biweight of every residual, times the light of the sample: a level is a smaller step where there is more.
fn weigh(residuals: &[f64], samples: &[Sample], weights: &mut Vec<f64>) {
    weights.clear();
    weights.extend(residuals.iter().map(|residual| residual.abs()));
    let spread = (1.4826 * median(weights.clone()).unwrap_or(0.0)).max(LEAST_SPREAD);
    let reach = 3.0 * spread;
    for ((weight, residual), sample) in weights.iter_mut().zip(residuals).zip(samples) {
        let ratio = residual / reach;
        let bell = (1.0 - ratio * ratio).max(0.0);
        let [r, g, b] = sample.target;
        *weight = bell * bell * (r + 2.0 * g + b);
    }
}

/// The four nodes around a place and their bilinear weights.
#[inline(never)]
fn corners([x, y]: [f32; 2], step: usize, columns: usize, rows: usize) -> [(usize, f64); 4] {
    let (x, y) = (f64::from(x) / step as f64, f64::from(y) / step as f64);
    let (i, j) = ((x as usize).min(columns.saturating_sub(2)), (y as usize).min(rows.saturating_sub(2)));
    let (u, v) = (x - i as f64, y - j as f64);
    let node = j * columns + i;
    let below = node + columns;
    [(node, (1.0 - u) * (1.0 - v)), (node + 1, u * (1.0 - v)), (below, (1.0 - u) * v), (below + 1, u * v)]
}

/// Gauss–Seidel: each node the mean of its samples, its neighbours and 0. `data` is the weight and the weighted sum.
fn relax(field: &mut [f64], data: &[[f64; 2]], columns: usize, rows: usize) {
    // Samples are weighted by their light: the pulls are in terms of their mean.
    let total: f64 = data.iter().map(|[weight, _]| weight).sum();
    let filled = data.iter().filter(|[weight, _]| *weight > 0.0).count().max(1);
    let scale = total / filled as f64 / 16.0;
    let (stiffness, damping) = (STIFFNESS * scale, DAMPING * scale);
    for _ in 0..SWEEPS {
        for j in 0..rows {
            for i in 0..columns {
                let node = j * columns + i;
                let [mut weight, mut sum] = data[node];
                let mut pull =
                    |neighbour: usize| (weight, sum) = (weight + stiffness, sum + stiffness * field[neighbour]);
                if i > 0 {
                    pull(node - 1);
                }
                if i + 1 < columns {
                    pull(node + 1);
                }
                if j > 0 {
                    pull(node - columns);
                }
                if j + 1 < rows {
                    pull(node + columns);
                }
                field[node] = sum / (weight + damping).max(f64::MIN_POSITIVE);
            }
        }
    }
}
