//! Gains from samples.

use super::samples::Sample;
use crate::Result;
use crate::components::neighbours;
use crate::image::{defaults, reserve};
use crate::statistics::median;

// Tuned on the evaluation cases. Half or twice as much of any changes PSNR and SSIM of the overlap by less than 0.1 %, visible
// steps along the seam by at most 3.5 % where nothing else is said.

/// Samples below which nothing is said about exposure. Flat between 6 and 24.
const FEWEST: usize = 12;
/// Gains farther from 1 than this factor are no exposure difference: five stops, as far as a series of exposures goes.
const LARGEST: f64 = 32.0;
/// Rounds of re-weighting.
const ROUNDS: usize = 8;
/// Standard deviation of the logarithms of the ratios that is never taken for misalignment.
const LEAST_DEVIATION: f64 = 0.02;

/// Variance of the logarithm of light that is not enough to see a slope.
const LEAST_CONTRAST: f64 = 0.02;
/// The channel that the others are held to.
const GREEN: usize = 1;
/// Slopes beyond this are no difference between cameras.
const STEEPEST: f64 = 0.4;
/// How far the slopes of red and blue may be from that of green.
const SLOPE_TINT: f64 = 0.05;

/// Nodes of the gain field along the canvas' longer side: with 8 there are 8 % more visible steps, with 32 7 % fewer.
const NODES: usize = 16;
/// Sweeps over the field. Flat between 30 and 120.
const SWEEPS: usize = 60;
/// Pull of a node's neighbours on it, in samples.
const STIFFNESS: f64 = 4.0;
/// Pull of the common gain on a node, in samples. Flat between 0.3 and 0.6; at 0.15 there are 7 % fewer visible steps.
const DAMPING: f64 = 0.3;
/// The most that the logarithm of green's gain may differ from the common one: beyond that the photos show different things. On
/// the development pairs the mean of all colours differs by at most 0.25.
const FARTHEST: f64 = 0.4;
/// How much farther than green's those of red and blue may be.
const TINT: f64 = 0.08;

/// What the target's light is multiplied by.
pub(super) struct ExposureModel {
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
    /// Row by row.
    pub nodes: Vec<Node>,
    pub columns: usize,
    pub rows: usize,
    /// Pixels from node to node; the first is at pixel 0.
    pub step: usize,
}

impl Field {
    /// Over a canvas of this size.
    fn over((width, height): (usize, usize)) -> Result<Self> {
        let step = width.max(height).div_ceil(NODES).max(1);
        let (columns, rows) = (width.div_ceil(step) + 1, height.div_ceil(step) + 1);
        Ok(Self { nodes: defaults(columns * rows)?, columns, rows, step })
    }
}

impl ExposureModel {
    /// The same gains all over a canvas of this size.
    pub fn constant(gains: [f64; 3], size: (usize, usize)) -> Result<Self> {
        let mut field = Field::over(size)?;
        for node in &mut field.nodes {
            node.gain[..3].copy_from_slice(&gains.map(|gain| gain as f32));
        }
        Ok(Self { gains, curves: Default::default(), field })
    }
}

/// A place of a [`Field`].
#[derive(Clone, Copy, Default)]
pub(super) struct Node {
    /// Red, green, blue; and how much of the target around is clipped, 0 to 1, once [`super::clipped::mark`] has looked.
    pub gain: [f32; 4],
    /// Of the channel that is fitted: logarithm of the gain here over the common one.
    local: f64,
    /// What that may differ from by [`Limits::local`] at most.
    centre: f64,
    /// Weight of the samples around, and the weighted sum of what they say about it.
    weight: f64,
    sum: f64,
}

/// How far a channel's gains may depend on light and place.
#[derive(Clone, Copy)]
struct Limits {
    /// Least and greatest slope of the curve.
    slope: [f64; 2],
    /// How far the logarithm of the gain at a node may be from [`Node::centre`].
    local: f64,
}

/// A sample as one channel sees it.
#[derive(Clone, Copy, Default)]
struct Observation {
    /// The four nodes around its place and their bilinear weights.
    nodes: [(usize, f64); 4],
    /// Logarithm of the target's light.
    light: f64,
    /// Logarithm of the ratio of the reference's light to the target's.
    ratio: f64,
    /// What the fit leaves of it.
    residual: f64,
    weight: f64,
}

/// The gains that carry the target's light into the reference's; `None` when there is too little to go by.
///
/// The logarithm of the ratio is a constant per channel and, with `vary`, a slope over the logarithm of light and a field with
/// little bending; samples that do not fit (something moved, or is misaligned) lose their weight (Tukey's biweight). The constants
/// may be known, as `joint` gains.
pub(super) fn fit(
    samples: &[Sample],
    size: (usize, usize),
    vary: bool,
    joint: Option<[f64; 3]>,
) -> Result<Option<ExposureModel>> {
    if samples.len() < FEWEST {
        return Ok(None);
    }
    let Field { mut nodes, columns, rows, step } = Field::over(size)?;
    let mut observations: Vec<Observation> = defaults(samples.len())?;
    let (mut gains, mut curves) = ([1.0; 3], [Curve::default(); 3]);
    let mut limits = Limits { slope: [-STEEPEST, STEEPEST], local: FARTHEST };
    let most = libm::log(LARGEST);
    // Green first: the others may not differ much from it.
    for c in [GREEN, 0, 2] {
        for (o, sample) in observations.iter_mut().zip(samples) {
            o.nodes = corners(sample.place, step, columns, rows);
            o.light = libm::log(sample.target[c]);
            o.ratio = libm::log(sample.reference[c]) - o.light;
        }
        nodes.iter_mut().for_each(|node| node.local = 0.0);
        let common;
        (common, curves[c]) = fit_channel(
            samples,
            &mut observations,
            (&mut nodes, columns),
            vary.then_some(limits),
            joint.map(|gains| libm::log(gains[c])),
        )?;
        // What the fit makes of the light of all samples: those that do not fit are light, too.
        let (mut before, mut after) = (f64::MIN_POSITIVE, 0.0);
        for (o, sample) in observations.iter().zip(samples) {
            before += sample.target[c];
            after += sample.target[c] * libm::exp(o.ratio - o.residual);
        }
        gains[c] = after / before;
        for node in &mut nodes {
            node.gain[c] = libm::exp((common + node.local).clamp(-most, most)) as f32;
        }
        if c == GREEN {
            nodes.iter_mut().for_each(|node| node.centre = node.local);
            let slope = curves[c].slope;
            limits = Limits { slope: [slope - SLOPE_TINT, slope + SLOPE_TINT], local: TINT };
        }
    }
    let sane = gains.iter().all(|gain| *gain > 1.0 / LARGEST && *gain < LARGEST);
    Ok(sane.then_some(ExposureModel { gains, curves, field: Field { nodes, columns, rows, step } }))
}

/// Logarithm of the common gain, and the curve, of one channel; the field is left in the nodes.
fn fit_channel(
    samples: &[Sample],
    observations: &mut [Observation],
    (nodes, columns): (&mut [Node], usize),
    limits: Option<Limits>,
    known: Option<f64>,
) -> Result<(f64, Curve)> {
    let mut curve = Curve::default();
    let mut common = match known {
        Some(known) => known,
        None => median_of(observations, &|o| o.ratio)?,
    };
    for _ in 0..ROUNDS {
        update_residuals(observations, nodes, common, curve);
        let reach = 3.0 * (1.4826 * median_of(observations, &|o| o.residual.abs())?).max(LEAST_DEVIATION);
        let (mut total, mut ratios, mut lights) = (f64::MIN_POSITIVE, 0.0, 0.0);
        for (o, sample) in observations.iter_mut().zip(samples) {
            // Times the light of the sample: a level is a smaller step where there is more. That of both photos: by the light of one,
            // misaligned samples would say that the other is darker.
            let [own, other] = [sample.target, sample.reference].map(|[r, g, b, _]| r + 2.0 * g + b);
            let bell = (1.0 - (o.residual / reach) * (o.residual / reach)).max(0.0);
            o.weight = bell * bell * (own * other).sqrt();
            (total, ratios, lights) = (total + o.weight, ratios + o.weight * o.ratio, lights + o.weight * o.light);
        }
        common = known.unwrap_or(ratios / total);
        let Some(limits) = limits else { continue };
        curve.pivot = lights / total;
        // How much farther the reference's light spreads than the target's, not how it follows from that: what is misaligned spreads as
        // far, but follows less.
        let (mut own, mut other) = (LEAST_CONTRAST * total, LEAST_CONTRAST * total);
        for o in &*observations {
            let contrast = o.light - curve.pivot;
            let across = contrast + o.residual + curve.slope * contrast;
            own += o.weight * contrast * contrast;
            other += o.weight * across * across;
        }
        let [least, greatest] = limits.slope;
        curve.slope = ((other / own).sqrt() - 1.0).max(least).min(greatest);
        nodes.iter_mut().for_each(|node| (node.weight, node.sum) = (0.0, 0.0));
        for o in &*observations {
            let local = o.ratio - common - curve.slope * (o.light - curve.pivot);
            for (node, share) in o.nodes {
                nodes[node].weight += o.weight * share;
                nodes[node].sum += o.weight * share * local;
            }
        }
        relax(nodes, columns, limits.local);
    }
    update_residuals(observations, nodes, common, curve);
    Ok((common, curve))
}

fn update_residuals(observations: &mut [Observation], nodes: &[Node], common: f64, curve: Curve) {
    for o in observations {
        o.residual = o.ratio - common - curve.slope * (o.light - curve.pivot);
        for (node, share) in o.nodes {
            o.residual -= share * nodes[node].local;
        }
    }
}

fn median_of(observations: &[Observation], value: &dyn Fn(&Observation) -> f64) -> Result<f64> {
    let mut values = Vec::new();
    reserve(&mut values, observations.len())?;
    values.extend(observations.iter().map(value));
    Ok(median(values).unwrap_or(0.0))
}

/// The four nodes around a place and their bilinear weights.
fn corners([x, y]: [f32; 2], step: usize, columns: usize, rows: usize) -> [(usize, f64); 4] {
    let (x, y) = (f64::from(x) / step as f64, f64::from(y) / step as f64);
    let (i, j) = ((x as usize).min(columns.saturating_sub(2)), (y as usize).min(rows.saturating_sub(2)));
    let (u, v) = (x - i as f64, y - j as f64);
    let node = j * columns + i;
    let below = node + columns;
    [(node, (1.0 - u) * (1.0 - v)), (node + 1, u * (1.0 - v)), (below, (1.0 - u) * v), (below + 1, u * v)]
}

/// Projected Gauss–Seidel: each node the mean of its samples, its neighbours and 0, as far as the limit allows.
fn relax(nodes: &mut [Node], columns: usize, limit: f64) {
    // Samples are weighted by their light: the pulls are in terms of their mean.
    let total: f64 = nodes.iter().map(|node| node.weight).sum();
    let filled = nodes.iter().filter(|node| node.weight > 0.0).count().max(1);
    let scale = total / filled as f64 / 16.0;
    let (stiffness, damping) = (STIFFNESS * scale, DAMPING * scale);
    for _ in 0..SWEEPS {
        for node in 0..nodes.len() {
            let Node { mut weight, mut sum, centre, .. } = nodes[node];
            for neighbour in neighbours(node, columns).into_iter().filter_map(|at| nodes.get(at)) {
                (weight, sum) = (weight + stiffness, sum + stiffness * neighbour.local);
            }
            let local = sum / (weight + damping).max(f64::MIN_POSITIVE);
            nodes[node].local = local.max(centre - limit).min(centre + limit);
        }
    }
}
