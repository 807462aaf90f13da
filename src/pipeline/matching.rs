//! Matches of our own, where the caller has none.

use super::alignment::Alignment;
use crate::features::{
    DetectOptions, Features, Guide, MatchOptions, Pair, detect, match_features, match_guided, matches_of,
};
use crate::geometry::Match;
use crate::observer::Observer;
use crate::{ImageView, Result};

/// Options of the search for matches.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureOptions {
    /// Keypoints and their descriptors.
    pub detect: DetectOptions,
    /// Which of them belong together.
    pub matching: MatchOptions,
    /// Whether to match once more along the epipolar lines, once the geometry is known.
    pub guided: bool,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { detect: Default::default(), matching: Default::default(), guided: true }
    }
}

/// The features of both photos and which of them belong together.
pub(super) struct Found {
    pub features: [Features; 2],
    pub pairs: Vec<Pair>,
    pub matches: Vec<Match>,
}

/// The features of target and reference.
pub(super) fn detect_both(
    target: ImageView<'_>,
    reference: ImageView<'_>,
    options: &FeatureOptions,
    observer: &mut dyn Observer,
) -> Result<[Features; 2]> {
    Ok([detect(target, &options.detect, observer)?, detect(reference, &options.detect, observer)?])
}

/// The pairs among the features of target and reference.
pub(super) fn match_both(
    features: [Features; 2],
    options: &FeatureOptions,
    observer: &mut dyn Observer,
) -> Result<Found> {
    let [target, reference] = &features;
    let pairs = match_features(target, reference, &options.matching, observer)?;
    let matches = matches_of(target, reference, &pairs);
    Ok(Found { features, pairs, matches })
}

/// The ratio test of the second search: there is little else in the band to mistake a feature for.
const GUIDED_RATIO: f64 = 0.9;

/// The matches that a search along the epipolar lines of `aligned` finds, and those of the first search that it leaves.
pub(super) fn match_again(
    found: &Found,
    aligned: &Alignment<'_>,
    options: &FeatureOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<Match>> {
    let [target, reference] = &found.features;
    let spread = aligned.spread(&found.matches)[0];
    let guide = Guide {
        forward: &aligned.geometry.forward,
        depth: aligned.depth[0].as_deref(),
        range: [0.0; 2],
        band: aligned.geometry.threshold,
        reach: aligned.geometry.threshold + 2.0 * spread,
    };
    let matching = MatchOptions { ratio: options.matching.ratio.max(GUIDED_RATIO), ..options.matching.clone() };
    let mut pairs = match_guided(target, reference, &guide, &matching, observer)?;
    // What the first search found stays unless the second one found something else for one of its features.
    let mut taken = [vec![false; target.keypoints.len()], vec![false; reference.keypoints.len()]];
    for pair in &pairs {
        taken[0][pair.target as usize] = true;
        taken[1][pair.reference as usize] = true;
    }
    let free = |pair: &&Pair| !taken[0][pair.target as usize] && !taken[1][pair.reference as usize];
    pairs.extend(found.pairs.iter().filter(free));
    Ok(matches_of(target, reference, &pairs))
}
