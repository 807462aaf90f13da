//! From matches to a model and its inliers: random search, then least squares and choice of inliers in turns.

use super::clean::flagged;
use super::errors::{Scales, count, errors, inliers_of, inlying};
use super::points::{Points, Projection};
use super::ransac::{Search, msac, refit};
use super::refine::refine;
use crate::sampler::Sampler;
use crate::statistics::median;

/// A model and the matches that agree with it.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    pub projection: Projection,
    /// The matches within the threshold.
    pub inliers: Vec<bool>,
    /// The matches the model was fitted to, all of them inliers.
    pub support: Vec<bool>,
    /// What chose the inliers, normalised.
    pub threshold: f64,
}

impl Consensus {
    /// Of a model fitted to all of its inliers.
    pub fn new(projection: Projection, inliers: Vec<bool>, threshold: f64) -> Self {
        Self { projection, support: inliers.clone(), inliers, threshold }
    }

    #[inline(never)]
    pub fn count(&self) -> usize {
        count(&self.inliers)
    }
}

/// What is fitted: a depth model has four columns, a homography three. A number rather than a type, so that there is one
/// copy of the code for both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Depth,
    Flat,
}

impl Kind {
    pub fn columns(self) -> usize {
        if self == Kind::Depth { 4 } else { 3 }
    }

    /// Matches that determine it.
    pub fn sample(self) -> usize {
        if self == Kind::Depth { 6 } else { 4 }
    }
}

/// Refinement on the inliers of a search: the paper's algorithm 1, and once more on those that are exact. Without that the
/// model depends on which of the matches near the paper's wide threshold, mostly wrong ones, a sample happens to let in.
#[inline(never)]
pub(super) fn published(points: &Points, found: &Projection, threshold: f64, kind: Kind) -> Option<Consensus> {
    let inliers = inliers_of(points, found, threshold);
    let projection = fitted(points, &inliers, Some(found), FINE, kind)?;
    polished(points, Consensus::new(projection, inliers, threshold), kind)
}

/// From what a search at all scales found down to the narrowest.
///
/// Two ways lead down: step by step from the widest threshold, which a bad start survives, and at once, which does not
/// let wrong matches in on the way. The model of the lower cost wins. When the narrowest threshold keeps less than three
/// quarters of what the widest does, the next wider one that keeps more is used: the model is not as exact as the caller
/// hoped.
#[inline(never)]
pub(super) fn narrowed(points: &Points, scales: &Scales, found: &Projection, kind: Kind) -> Option<Consensus> {
    let (wide, narrow) = (scales.widest(), scales.narrowest());
    let most = count(&inliers_of(points, found, wide));
    let (mut chosen, mut least) = (None, f64::INFINITY);
    // From the narrowest to the narrowest is at once.
    for from in [wide, narrow] {
        let way = descent(points, found, from, narrow, kind);
        let cost = way.as_ref().map_or(f64::INFINITY, |c| scales.cost(points, &c.projection, f64::INFINITY));
        if chosen.is_none() || cost < least {
            (chosen, least) = (way, cost);
        }
    }
    let mut chosen = chosen?;
    while 4 * chosen.count() < 3 * most && chosen.threshold < wide {
        let threshold = (chosen.threshold / STEP).min(wide);
        chosen = descent(points, found, wide, threshold, kind)?;
    }
    polished(points, chosen, kind)
}

/// Fits once more to the inliers that are as exact as most of them, then chooses the inliers at their threshold again:
/// within a threshold of pixels, the few matches near it are mostly wrong or at wrong depths, and would weigh the most.
#[inline(never)]
fn polished(points: &Points, consensus: Consensus, kind: Kind) -> Option<Consensus> {
    let Consensus { projection, inliers, threshold, .. } = consensus;
    // The errors of points whose coordinates err by σ have the median 1.177 σ (Rayleigh).
    let sigma = median(inlying(points, &projection, threshold))?.sqrt() / 1.177;
    let narrower = (3.0 * sigma).max(0.01 * threshold).min(threshold);
    let (start, chosen) = match settled(points, projection, narrower, kind) {
        Some(core) if 2 * core.count() > count(&inliers) => (core.projection, core.inliers),
        _ => (projection, inliers),
    };
    let projection = fitted(points, &chosen, Some(&start), FINE, kind)?;
    let inliers = inliers_of(points, &projection, threshold);
    let support = chosen.iter().zip(&inliers).map(|(a, b)| *a && *b).collect();
    Some(Consensus { projection, inliers, support, threshold })
}

/// Where least squares stop on the way and at the end.
const COARSE: f64 = 1e-3;
pub(super) const FINE: f64 = 1e-10;

/// Factor from one threshold to the next narrower.
const STEP: f64 = 0.6;

/// Narrows the threshold from `from` to `to`, refitting at each step, and settles there.
#[inline(never)]
fn descent(points: &Points, start: &Projection, from: f64, to: f64, kind: Kind) -> Option<Consensus> {
    let (mut projection, mut threshold) = (*start, from);
    while threshold > to {
        projection = fitted(points, &inliers_of(points, &projection, threshold), Some(&projection), COARSE, kind)?;
        threshold *= STEP;
    }
    settled(points, projection, to, kind)
}

/// Refits to the inliers and chooses them anew until they stay the same.
#[inline(never)]
fn settled(points: &Points, mut projection: Projection, threshold: f64, kind: Kind) -> Option<Consensus> {
    let mut inliers = inliers_of(points, &projection, threshold);
    for _ in 0..20 {
        projection = fitted(points, &inliers, Some(&projection), COARSE, kind)?;
        let next = inliers_of(points, &projection, threshold);
        if next == inliers {
            break;
        }
        inliers = next;
    }
    Some(Consensus::new(projection, inliers, threshold))
}

/// Least squares on the flagged matches, from the linear fit to them or `start`, whichever is nearer. `None` when they do
/// not determine the model.
#[inline(never)]
pub(super) fn fitted(
    points: &Points,
    inliers: &[bool],
    start: Option<&Projection>,
    tolerance: f64,
    kind: Kind,
) -> Option<Projection> {
    if count(inliers) < kind.sample() {
        return None;
    }
    let linear = refit(points, inliers, kind);
    let chosen = points.select(inliers);
    let sum = |p: &Projection| errors(&chosen, p).iter().sum::<f64>();
    let start = match (&linear, start) {
        (Some(linear), Some(start)) if sum(start) < sum(linear) => start,
        (linear, start) => linear.as_ref().or(start)?,
    };
    // A wrong depth can put a match behind the camera, where there is nothing to descend.
    let front: Vec<bool> = chosen.iter().map(|p| p.third(start) > 0.0).collect();
    Some(refine(&chosen.select(&front), start, kind.columns(), tolerance))
}

/// Homographies one after the other, each the best for the matches the ones before left over (Zaragoza et al. 2014):
/// flags of all their inliers, and the trials. A homography counts when at least `enough(matches left)` agree with it.
#[inline(never)]
pub(super) fn many_homographies(
    points: &Points,
    search: &Search,
    sampler: &mut Sampler,
    enough: &dyn Fn(usize) -> usize,
) -> (Vec<bool>, u32) {
    const MOST: usize = 10;
    let mut union = vec![false; points.len()];
    let mut trials = 0;
    for _ in 0..MOST {
        let open: Vec<bool> = union.iter().map(|f| !f).collect();
        let left = flagged(&(0..points.len()).collect::<Vec<_>>(), &open);
        let rest = points.select(&open);
        let Some(found) = msac(&rest, search, sampler, Kind::Flat) else { break };
        trials += found.trials;
        let inliers = inliers_of(&rest, &found.projection, search.scales.narrowest());
        if count(&inliers) < enough(left.len()) {
            break;
        }
        flagged(&left, &inliers).into_iter().for_each(|i| union[i] = true);
    }
    (union, trials)
}
