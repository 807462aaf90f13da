//! Matches of our own, when the caller has none.

use super::align::Alignment;
use crate::features::{
    DetectOptions, Features, MatchGuide, MatchOptions, Pair, detect, match_again, match_features, matches_of,
};
use crate::geometry::Match;
use crate::observer::{Observer, Subject};
use crate::workers::{Task, Workers, without_waiting};
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
    photos: [ImageView<'_>; 2],
    options: &DetectOptions,
    observer: &mut dyn Observer,
) -> Result<[Features; 2]> {
    without_waiting(detect_both(photos, options, &(), observer))
}

/// As [`detect_pair`], with the photos left to workers.
pub(super) async fn detect_both(
    photos: [ImageView<'_>; 2],
    options: &DetectOptions,
    workers: &DetectWorkers,
    observer: &mut dyn Observer,
) -> Result<[Features; 2]> {
    let tasks = photos.map(|photo| Detect { subject: Subject::All, photo, options });
    let mut found = photos.map(|photo| Features { keypoints: Vec::new(), descriptors: Vec::new(), size: photo.size() });
    let mut take = |i: usize, features| {
        found[i] = features;
        Ok(())
    };
    workers.perform(&tasks, &mut take, observer).await?;
    Ok(found)
}

/// The task to detect the features of a photo.
pub(crate) struct Detect<'a> {
    pub subject: Subject,
    pub photo: ImageView<'a>,
    pub options: &'a DetectOptions,
}

/// Who performs such tasks.
pub(crate) type DetectWorkers = dyn for<'a> Workers<Detect<'a>>;

impl Task for Detect<'_> {
    type Output = Features;

    fn subject(&self) -> Subject {
        self.subject
    }

    fn perform(&self, observer: &mut dyn Observer) -> Result<Features> {
        detect(self.photo, self.options, observer)
    }
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
