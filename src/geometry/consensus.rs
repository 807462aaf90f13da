//! From matches to inliers: the search, and what follows it.

use super::points::{Points, Projection, msac_cost};
use super::ransac::{Search, inliers_of, msac, refit};
use super::refine::refine;
use super::sampler::Sampler;

/// A model and the matches within its threshold.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    pub projection: Projection,
    pub inliers: Vec<bool>,
    /// Normalised.
    pub threshold: f64,
    pub trials: u32,
}

impl Consensus {
    pub fn count(&self) -> usize {
        self.inliers.iter().filter(|f| **f).count()
    }
}

/// Random search at one threshold, D = 4 with depth, 3 for a homography.
pub(super) fn search<const D: usize>(points: &Points, search: &Search, sampler: &mut Sampler) -> Option<Consensus> {
    let found = if D == 4 { msac::<4, 6>(points, search, sampler) } else { msac::<3, 4>(points, search, sampler) }?;
    let inliers = inliers_of(points, &found.projection, search.threshold * search.threshold);
    Some(Consensus { projection: found.projection, inliers, threshold: search.threshold, trials: found.trials })
}

/// Least squares on the inliers, linear first; keeps them.
pub(super) fn refined(points: &Points, inliers: &[bool], start: Option<Projection>, columns: usize) -> Option<Projection> {
    let linear = if columns == 4 { refit::<4>(points, inliers) } else { refit::<3>(points, inliers) };
    let chosen = points.select(inliers);
    let sum = |p: &Projection| chosen.errors(p).sum::<f64>();
    let start = match (linear, start) {
        (Some(a), Some(b)) => if sum(&a) <= sum(&b) { a } else { b },
        (a, b) => a.or(b)?,
    };
    Some(refine(&chosen, &start, columns))
}

/// Least squares and choice of inliers in turns, the threshold coming down to `to`, then to a fixed point.
pub(super) fn narrow(points: &Points, mut consensus: Consensus, to: f64, columns: usize) -> Consensus {
    const SHRINK: f64 = 0.6;
    for _ in 0..30 {
        let last = consensus.threshold <= to;
        let Some(p) = refined(points, &consensus.inliers, Some(consensus.projection), columns) else { break };
        consensus.projection = p;
        consensus.threshold = (consensus.threshold * SHRINK).max(to);
        let inliers = inliers_of(points, &p, consensus.threshold * consensus.threshold);
        if inliers.iter().filter(|f| **f).count() < columns + 2 {
            break;
        }
        let settled = last && inliers == consensus.inliers;
        consensus.inliers = inliers;
        if settled {
            break;
        }
    }
    consensus
}

pub(super) fn cost(points: &Points, c: &Consensus, t: f64) -> f64 {
    msac_cost(points, &c.projection, t * t, f64::INFINITY)
}
