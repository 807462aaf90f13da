//! From matches to a model and its inliers: random search, then least squares and choice of inliers in turns.

use super::errors::{Scales, count, errors, inliers_of, inlying};
use super::points::{Points, Projection};
use super::ransac::{Search, msac, refit};
use super::refine::refine;
use super::sampler::Sampler;
use super::statistics::median;

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
    pub trials: u32,
}

impl Consensus {
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

/// Random search; the inliers are those at the narrowest threshold.
pub(super) fn sampled(points: &Points, search: &Search, sampler: &mut Sampler, kind: Kind) -> Option<Consensus> {
    let found = msac(points, search, sampler, kind)?;
    let threshold = search.scales.narrowest();
    let inliers = inliers_of(points, &found.projection, threshold);
    Some(Consensus { projection: found.projection, support: inliers.clone(), inliers, threshold, trials: found.trials })
}

/// Refinement on the inliers of a search: the paper's algorithm 1, and once more on those that are exact. Without that the
/// model depends on which of the matches near the paper's wide threshold, mostly wrong ones, a sample happens to let in.
pub(super) fn published(points: &Points, found: Consensus, kind: Kind) -> Option<Consensus> {
    let projection = fitted(points, &found.inliers, Some(found.projection), FINE, kind)?;
    polished(points, Consensus { projection, ..found }, kind)
}

/// From what a search at all scales found down to the narrowest.
///
/// Two ways lead down: step by step from the widest threshold, which a bad start survives, and at once, which does not
/// let wrong matches in on the way. The model of the lower cost wins. When the narrowest threshold keeps less than three
/// quarters of what the widest does, the next wider one that keeps more is used: the model is not as exact as the caller
/// hoped.
pub(super) fn narrowed(points: &Points, scales: &Scales, found: Consensus, kind: Kind) -> Option<Consensus> {
    let wide = count(&inliers_of(points, &found.projection, scales.widest()));
    let steps = descent(points, found.projection, scales.widest(), scales.narrowest(), kind);
    let at_once = settled(points, found.projection, scales.narrowest(), kind);
    let cost = |c: &Consensus| scales.cost(points, &c.projection, f64::INFINITY);
    let mut chosen = match (steps, at_once) {
        (Some(a), Some(b)) => {
            if cost(&a) <= cost(&b) {
                a
            } else {
                b
            }
        }
        (a, b) => a.or(b)?,
    };
    while 4 * chosen.count() < 3 * wide && chosen.threshold < scales.widest() {
        let threshold = (chosen.threshold / STEP).min(scales.widest());
        chosen = descent(points, found.projection, scales.widest(), threshold, kind)?;
    }
    Some(Consensus { trials: found.trials, ..polished(points, chosen, kind)? })
}

/// Fits once more to the inliers that are as exact as most of them, then chooses the inliers at their threshold again:
/// within a threshold of pixels, the few matches near it are mostly wrong or at wrong depths, and would weigh the most.
fn polished(points: &Points, consensus: Consensus, kind: Kind) -> Option<Consensus> {
    // The errors of points whose coordinates err by σ have the median 1.177 σ (Rayleigh).
    let sigma = median(inlying(points, &consensus.projection, consensus.threshold))?.sqrt() / 1.177;
    let threshold = (3.0 * sigma).max(0.01 * consensus.threshold).min(consensus.threshold);
    let core = settled(points, consensus.projection, threshold, kind);
    let core = core.filter(|core| 2 * core.count() > consensus.count()).unwrap_or(consensus.clone());
    let projection = fitted(points, &core.inliers, Some(core.projection), FINE, kind)?;
    let inliers = inliers_of(points, &projection, consensus.threshold);
    let support = core.inliers.iter().zip(&inliers).map(|(a, b)| *a && *b).collect();
    Some(Consensus { projection, inliers, support, ..consensus })
}

/// Where least squares stop on the way and at the end.
const COARSE: f64 = 1e-3;
pub(super) const FINE: f64 = 1e-10;

/// Factor from one threshold to the next narrower.
const STEP: f64 = 0.6;

/// Narrows the threshold from `from` to `to`, refitting at each step, and settles there.
fn descent(points: &Points, mut projection: Projection, from: f64, to: f64, kind: Kind) -> Option<Consensus> {
    let mut threshold = from;
    while threshold > to {
        projection = fitted(points, &inliers_of(points, &projection, threshold), Some(projection), COARSE, kind)?;
        threshold *= STEP;
    }
    settled(points, projection, to, kind)
}

/// Refits to the inliers and chooses them anew until they stay the same.
fn settled(points: &Points, mut projection: Projection, threshold: f64, kind: Kind) -> Option<Consensus> {
    let mut inliers = inliers_of(points, &projection, threshold);
    for _ in 0..20 {
        projection = fitted(points, &inliers, Some(projection), COARSE, kind)?;
        let next = inliers_of(points, &projection, threshold);
        if next == inliers {
            break;
        }
        inliers = next;
    }
    Some(Consensus { projection, support: inliers.clone(), inliers, threshold, trials: 0 })
}

/// Least squares on the flagged matches, from the linear fit to them or `start`, whichever is nearer. `None` when they do
/// not determine the model.
pub(super) fn fitted(
    points: &Points,
    inliers: &[bool],
    start: Option<Projection>,
    tolerance: f64,
    kind: Kind,
) -> Option<Projection> {
    if count(inliers) < kind.sample() {
        return None;
    }
    let linear = refit(points, inliers, kind);
    let chosen = points.select(inliers);
    let sum = |p: &Projection| errors(&chosen, p).iter().sum::<f64>();
    let start = match (linear, start) {
        (Some(linear), Some(start)) if sum(&start) < sum(&linear) => start,
        (linear, start) => linear.or(start)?,
    };
    // A wrong depth can put a match behind the camera, where there is nothing to descend.
    let front: Vec<bool> = chosen.iter().map(|p| p.third(&start) > 0.0).collect();
    Some(refine(&chosen.select(&front), &start, kind.columns(), tolerance))
}

/// Homographies one after the other, each the best for the matches the ones before left over (Zaragoza et al. 2014):
/// flags of all their inliers, and the trials. A homography counts when at least `enough(matches left)` agree with it.
pub(super) fn many_homographies(
    points: &Points,
    search: &Search,
    sampler: &mut Sampler,
    enough: impl Fn(usize) -> usize,
) -> (Vec<bool>, u32) {
    const MOST: usize = 10;
    let mut union = vec![false; points.len()];
    let mut trials = 0;
    for _ in 0..MOST {
        let left: Vec<usize> = (0..points.len()).filter(|&i| !union[i]).collect();
        let rest = points.select(&union.iter().map(|f| !f).collect::<Vec<_>>());
        let Some(found) = sampled(&rest, search, sampler, Kind::Flat) else { break };
        trials += found.trials;
        if found.count() < enough(left.len()) {
            break;
        }
        for (i, _) in left.iter().zip(&found.inliers).filter(|(_, f)| **f) {
            union[*i] = true;
        }
    }
    (union, trials)
}
