//! Random sample consensus with the MSAC score and an adaptive number of trials.

use super::consensus::Kind;
use super::errors::{Scales, count, inliers_of};
use super::linear::fit;
use super::points::{Points, Projection};
use super::vectors::scale;
use crate::sampler::Sampler;

/// How to search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    pub scales: Scales,
    pub confidence: f64,
    pub max_trials: u32,
    /// Whether each best-so-far model is refitted to its inliers (Chum, Matas & Kittler 2003).
    pub local: bool,
}

impl Search {
    /// Samples of `k` that are needed to find one without outliers, at least `least` of them, when this share of the matches
    /// are inliers: ln(1 − conf) / ln(1 − shareᵏ); log1p, as 1 − shareᵏ rounds to 1 for a tiny share.
    #[inline(never)]
    pub fn needed(&self, share: f64, k: usize, least: f64) -> f64 {
        let clean = (0..k).fold(1.0, |p, _| p * share);
        let most = f64::from(self.max_trials);
        if clean > 0.0 {
            let enough = libm::log1p(-self.confidence) / libm::log1p(-clean);
            enough.ceil().max(least).min(most)
        } else {
            most
        }
    }
}

/// What a search found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub projection: Projection,
    pub trials: u32,
}

/// A sample must vary by this share of all matches' variance in x, y and (depth model) d, each beyond what the ones
/// before explain: in one spot, on one line or on one plane of depth it tells nothing.
const SAMPLE_SPREAD: f64 = 1e-6;

/// The same for a fit to many matches, where only rounding must be told from variance.
const FIT_SPREAD: f64 = 1e-10;

/// A sample without outliers is not yet a good one: where most matches lie on one plane, so do most clean samples. So
/// many are drawn in any case, which takes well under a millisecond.
const LEAST_TRIALS: f64 = 300.0;

/// The best of the models through as many random matches as determine one.
/// `None` when no sample gave a model.
pub(super) fn msac(points: &Points, search: &Search, sampler: &mut Sampler, kind: Kind) -> Option<Found> {
    let n = points.len();
    let mut sample = vec![0; kind.sample()];
    let scales = &search.scales;
    let mut best: Option<Projection> = None;
    let mut cost = f64::INFINITY;
    let mut needed = f64::from(search.max_trials);
    let mut trials = 0;
    while f64::from(trials) < needed && n >= sample.len() {
        trials += 1;
        sampler.sample(n, &mut sample);
        let Some(model) = fit(points, &sample, kind.columns(), SAMPLE_SPREAD) else { continue };
        let Some(mut model) = oriented(model, points, &sample) else { continue };
        let sampled = scales.cost(points, &model, cost);
        if sampled >= cost {
            continue;
        }
        cost = sampled;
        for t in if search.local { &scales.0[..] } else { &[] } {
            while let Some(local) = refit(points, &inliers_of(points, &model, *t), kind) {
                let refitted = scales.cost(points, &local, cost);
                if refitted >= cost {
                    break;
                }
                (model, cost) = (local, refitted);
            }
        }
        best = Some(model);
        let ratio = count(&inliers_of(points, &model, scales.narrowest())) as f64 / n as f64;
        needed = search.needed(ratio, sample.len(), LEAST_TRIALS);
    }
    best.map(|projection| Found { projection, trials })
}

/// The linear fit to the flagged matches, most of them in front of the camera.
#[inline(never)]
pub(super) fn refit(points: &Points, inliers: &[bool], kind: Kind) -> Option<Projection> {
    let indices: Vec<usize> = inliers.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i).collect();
    let model = fit(points, &indices, kind.columns(), FIT_SPREAD)?;
    let behind = indices.iter().filter(|&&i| points[i].third(&model) < 0.0).count();
    Some(if 2 * behind > indices.len() { negated(model) } else { model })
}

/// The projection or its negative, whichever has the sample in front of the camera; `None` when it is on both sides.
fn oriented(model: Projection, points: &Points, sample: &[usize]) -> Option<Projection> {
    let behind = sample.iter().filter(|&&i| points[i].third(&model) <= 0.0).count();
    match behind {
        0 => Some(model),
        _ if behind == sample.len() => Some(negated(model)),
        _ => None,
    }
}

fn negated(mut model: Projection) -> Projection {
    scale(model.as_flattened_mut(), -1.0);
    model
}
