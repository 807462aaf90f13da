//! Matches of our own, when the caller has none.

use super::align::Alignment;
use crate::features::{
    DetectOptions, Features, MatchGuide, MatchOptions, Pair, detect, match_again, match_features, matches_of,
};
use crate::geometry::Match;
use crate::observer::{Observer, Portion};
use crate::{ImageView, Result};

/// Options of feature detection and matching.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureOptions {
    /// Keypoints and their descriptors.
    pub detect: DetectOptions,
    /// Descriptor matching.
    pub matching: MatchOptions,
    /// Whether to match once more along the epipolar lines, once the geometry is known.
    pub guided: bool,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { detect: Default::default(), matching: Default::default(), guided: true }
    }
}

/// What is known of two photos before they are stitched.
#[derive(Debug, Clone, Default)]
pub struct Precomputed<'a> {
    /// Their matches: then features play no part.
    pub matches: Option<&'a [Match]>,
    /// The features of target and reference, as [`detect`] finds them with the same options.
    pub features: Option<[Features; 2]>,
}

impl<'a> Precomputed<'a> {
    /// Matches, if there are any.
    pub(super) fn of(matches: Option<&'a [Match]>) -> Self {
        Self { matches, features: None }
    }

    /// Refuses features of photos of other sizes.
    pub(super) fn check(&self, photos: [ImageView<'_>; 2]) -> Result<()> {
        let Some(features) = &self.features else { return Ok(()) };
        features.iter().zip(photos).try_for_each(|(features, photo)| features.check_size(photo.size()))
    }
}

/// The features of both photos, and which of them correspond.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedFeatures {
    /// Of target and reference.
    pub features: [Features; 2],
    /// Indices into them.
    pub pairs: Vec<Pair>,
    /// The same pairs by position, in pixels of the photos.
    pub matches: Vec<Match>,
}

/// Detects the features of target and reference.
///
/// # Errors
/// Those of [`detect`].
pub fn detect_pair(
    [target, reference]: [ImageView<'_>; 2],
    options: &DetectOptions,
    observer: &mut dyn Observer,
) -> Result<[Features; 2]> {
    // One stage, two photos: the second one starts where the first one ended.
    let share = target.pixels().len() as f32 / (target.pixels().len() + reference.pixels().len()) as f32;
    let target = detect(target, options, &mut Portion::new(observer, 0.0, share))?;
    let reference = detect(reference, options, &mut Portion::new(observer, share, 1.0))?;
    Ok([target, reference])
}

/// Matches the features of target and reference by their descriptors.
///
/// # Errors
/// Those of [`match_features`].
pub fn match_pair(
    features: [Features; 2],
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<MatchedFeatures> {
    let [target, reference] = &features;
    let pairs = match_features(target, reference, options, observer)?;
    let matches = matches_of(target, reference, &pairs);
    Ok(MatchedFeatures { features, pairs, matches })
}

/// The ratio test of guided matching: a search band along the epipolar line holds few other features to confuse one with.
const GUIDED_RATIO: f64 = 0.9;

/// Matches again, along the epipolar lines of `alignment`. A pair of the first matching stays unless guided matching
/// assigned one of its features to another.
///
/// # Errors
/// Those of [`match_guided`](crate::features::match_guided).
pub(super) fn match_along_epipolar_lines(
    first: &MatchedFeatures,
    alignment: &Alignment<'_>,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<Match>> {
    let [target, reference] = &first.features;
    let [error, _] = alignment.inlier_error(&first.matches);
    let threshold = alignment.geometry.threshold;
    let guide = MatchGuide {
        forward: &alignment.geometry.forward,
        depth: alignment.depth[0].as_deref(),
        range: [0.0; 2],
        band: threshold,
        reach: threshold + 2.0 * error,
    };
    let options = MatchOptions { ratio: options.ratio.max(GUIDED_RATIO), ..options.clone() };
    let pairs = match_again(target, reference, first.pairs.iter().copied(), &guide, &options, observer)?;
    Ok(matches_of(target, reference, &pairs))
}
