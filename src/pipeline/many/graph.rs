//! The pair graph: which photos overlap, and the matches that say so.

use super::ManyWorkers;
use crate::features::{Features, MatchOptions, match_features, matches_of};
use crate::geometry::{EstimateOptions, ModelKind, PairLink, two_view_geometry};
use crate::observer::{Observer, Portion, Subject};
use crate::pipeline::Detect;
use crate::pipeline::models::if_possible;
use crate::pipeline::options::Options;
use crate::workers::Task;
use crate::{ImageView, Result, Stage};

/// Up to so many photos all pairs are matched; beyond, each photo with so many others.
const CANDIDATES: usize = 8;
/// Most features of a photo that are matched: the work grows with their square, and tracks through several photos make up for
/// what a pair lacks.
pub(super) const FEATURES: usize = 5000;
/// The strongest features of each photo are matched first, to find the others that it may overlap.
const STRONGEST: usize = 400;
/// Beyond [`CANDIDATES`] photos so many of the strongest are matched at first, a sixth of the work, which is enough where so many of them
/// agree: a photo with many neighbours needs not all matches with each.
const FIRST: usize = 2000;
const ENOUGH: usize = 300;
/// How much of the work on a pair that is.
const QUICK: f32 = 0.2;
/// Fewer inliers say nothing about a pair, though they may be more than chance.
pub(super) const FEWEST: usize = 20;

/// Two photos that were compared.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoPair {
    /// Indices of both photos, ascending.
    pub photos: [usize; 2],
    /// Matching features.
    pub matches: usize,
    /// Those that agree on one geometry.
    pub inliers: usize,
    /// Whether the two are taken to show the same scene: by enough inliers, whose geometry does not contradict that of other
    /// pairs, or by what was matched once the cameras were known.
    pub linked: bool,
}

/// Photos and the pairs of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Graph {
    /// What ties photos together.
    pub links: Vec<PairLink>,
    /// All that were compared.
    pub pairs: Vec<PhotoPair>,
    /// Photos that are tied together, and the features in both of each match that contradicts what ties them.
    pub outliers: Vec<([usize; 2], Vec<[u32; 2]>)>,
}

/// Detects the features of every photo.
pub(super) async fn features(
    photos: &[ImageView<'_>],
    options: &Options,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
) -> Result<Vec<Features>> {
    let options = &options.features.detect;
    let task = |(i, &photo)| Detect { subject: Subject::Photo(i), photo, options };
    let tasks: Vec<Detect<'_>> = photos.iter().enumerate().map(task).collect();
    let mut found = Vec::with_capacity(tasks.len());
    let mut take = |_, features| {
        found.push(matched(features));
        Ok(())
    };
    workers.perform(&tasks, &mut take, observer).await?;
    Ok(found)
}

/// The features of a photo that are matched: the strongest ones.
fn matched(mut features: Features) -> Features {
    features.keypoints.truncate(FEATURES);
    features.descriptors.truncate(FEATURES);
    features
}

/// Compares the photos, pair by pair.
pub(super) async fn pair_graph(
    features: &[Features],
    options: &Options,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
) -> Result<Graph> {
    let candidates = candidates(features, &options.features.matching, &mut Portion::new(observer, 0.0, 0.2))?;
    let strongest_first = features.len() > CANDIDATES;
    let task = |photos: [usize; 2]| MatchPhotos {
        photos,
        features: photos.map(|photo| &features[photo]),
        strongest_first,
        options,
    };
    let tasks: Vec<MatchPhotos<'_>> = candidates.into_iter().map(task).collect();
    let mut graph = Graph::default();
    let mut take = |_, MatchedPhotos { pair, link, outliers }: MatchedPhotos| {
        graph.outliers.extend(link.as_ref().map(|link| (link.photos, outliers)));
        graph.links.extend(link);
        graph.pairs.push(pair);
        Ok(())
    };
    workers.perform(&tasks, &mut take, &mut Portion::new(observer, 0.2, 1.0)).await?;
    Ok(graph)
}

/// The task to match two photos.
pub(crate) struct MatchPhotos<'a> {
    /// Indices of both.
    pub photos: [usize; 2],
    pub features: [&'a Features; 2],
    /// Whether the strongest features will do if enough of them agree.
    pub strongest_first: bool,
    pub options: &'a Options,
}

/// What came of it.
pub(crate) struct MatchedPhotos {
    pub pair: PhotoPair,
    /// What ties them together, if anything does.
    pub link: Option<PairLink>,
    /// The features in both of each match that contradicts it.
    pub outliers: Vec<[u32; 2]>,
}

impl Task for MatchPhotos<'_> {
    type Output = MatchedPhotos;

    fn subject(&self) -> Subject {
        Subject::Pair(self.photos)
    }

    fn perform(&self, observer: &mut dyn Observer) -> Result<MatchedPhotos> {
        let Self { photos, features: [a, b], options, .. } = *self;
        let mut from = 0.0;
        if self.strongest_first && a.keypoints.len().max(b.keypoints.len()) > FIRST {
            let [a, b] = [a, b].map(|features| strongest(features, FIRST));
            let found = compare(photos, [&a, &b], options, &mut Portion::new(observer, 0.0, QUICK))?;
            if found.pair.inliers >= ENOUGH {
                return Ok(found);
            }
            from = QUICK;
        }
        compare(photos, [a, b], options, &mut Portion::new(observer, from, 1.0))
    }
}

/// The pairs that are worth a comparison.
fn candidates(features: &[Features], options: &MatchOptions, observer: &mut dyn Observer) -> Result<Vec<[usize; 2]>> {
    let count = features.len();
    let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    if count <= CANDIDATES {
        return Ok(all.collect());
    }
    let few: Vec<Features> = features.iter().map(|features| strongest(features, STRONGEST)).collect();
    let pairs = count * (count - 1) / 2;
    let mut scores: Vec<([usize; 2], usize)> = Vec::with_capacity(pairs);
    for (i, photos) in all.enumerate() {
        observer.subject(Subject::Pair(photos));
        let mut portion = Portion::new(observer, i as f32 / pairs as f32, (i + 1) as f32 / pairs as f32);
        let [a, b] = photos;
        scores.push((photos, match_features(&few[a], &few[b], options, &mut portion)?.len()));
    }
    // Of either photo's best ones.
    let rank = |photo: usize, own: &([usize; 2], usize)| {
        let better = |other: &&([usize; 2], usize)| {
            other.0.contains(&photo) && (other.1 > own.1 || other.1 == own.1 && other.0 < own.0)
        };
        scores.iter().filter(better).count()
    };
    let kept = scores.iter().filter(|own| own.0.iter().any(|&photo| rank(photo, own) < CANDIDATES));
    Ok(kept.map(|(photos, _)| *photos).collect())
}

/// The strongest features of a photo: they come first.
fn strongest(features: &Features, count: usize) -> Features {
    Features {
        keypoints: features.keypoints.iter().take(count).copied().collect(),
        descriptors: features.descriptors.iter().take(count).copied().collect(),
        ..*features
    }
}

/// Matches two photos and looks for one geometry that the matches agree on.
fn compare(
    photos: [usize; 2],
    [a, b]: [&Features; 2],
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<MatchedPhotos> {
    let pairs = match_features(a, b, &options.features.matching, &mut Portion::new(observer, 0.0, 0.7))?;
    let matches = matches_of(a, b, &pairs);
    let mut pair = PhotoPair { photos, matches: matches.len(), inliers: 0, linked: false };
    let estimate = EstimateOptions { focal: None, ..options.estimate.clone() };
    // Its own stages run once for every pair.
    let verifying = &mut Portion::of_stage(observer, Stage::Match, 1.0, 1.0);
    let found = two_view_geometry(&matches, [a.size, b.size], &estimate, verifying);
    let Some(found) = if_possible(found)? else { return Ok(MatchedPhotos { pair, link: None, outliers: Vec::new() }) };
    let flags = &found.estimate.inliers;
    pair.inliers = flags.iter().filter(|flag| **flag).count();
    pair.linked = pair.inliers >= FEWEST;
    let inlying = |i: &usize| flags[*i];
    let features_where = |wanted: bool| {
        let chosen = pairs.iter().zip(flags).filter(move |(_, inlying)| **inlying == wanted);
        chosen.map(|(pair, _)| [pair.target, pair.reference]).collect()
    };
    let link = pair.linked.then(|| PairLink {
        photos,
        features: features_where(true),
        matches: (0..matches.len()).filter(inlying).map(|i| matches[i]).collect(),
        model: found.estimate.forward,
        kind: if found.samples.is_some() { ModelKind::TwoView } else { ModelKind::Homography },
    });
    Ok(MatchedPhotos { pair, link, outliers: features_where(false) })
}

/// The photos of the largest group that links connect, ascending; of several the one with the first photo. With a `reference`
/// it is that photo's group.
pub(super) fn largest_group(count: usize, reference: Option<usize>, links: &[PairLink]) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..count).collect();
    for link in links {
        let [a, b] = link.photos.map(|photo| groups[photo]);
        groups.iter_mut().filter(|group| **group == a.max(b)).for_each(|group| *group = a.min(b));
    }
    let size = |group: usize| groups.iter().filter(|other| **other == group).count();
    let largest = (0..count).max_by_key(|&group| (size(group), count - group)).unwrap_or(0);
    let largest = reference.map_or(largest, |reference| groups[reference]);
    (0..count).filter(|&photo| groups[photo] == largest).collect()
}
