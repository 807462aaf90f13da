//! Where the photos were taken from, by their matches: features → pair graph → geometry.

use super::graph::{FEWEST, Graph, PhotoPair, features, largest_group, pair_graph};
use super::guided::{more_matches, refine};
use super::memory::Budget;
use super::result::{Photo, PhotoCode};
use super::undistorted::UndistortedPhotos;
use super::{ManyOptions, ManyWorkers};
use crate::features::{Pair, matches_of};
use crate::geometry::{Camera, Distortion, Lens, Match, MultiView, MultiViewKind, PairLink, multi_view};
use crate::observer::{Observer, Portion, Subject, report};
use crate::pipeline::timer::StageTimer;
use crate::{Error, ImageView, Result, Stage};

/// What the matches of all photos say.
pub(super) struct Located {
    pub geometry: MultiView,
    /// The photos that have a place in it, ascending.
    pub placed: Vec<usize>,
    /// What is to become of each photo, as far as is known.
    pub codes: Vec<PhotoCode>,
    /// The pairs of photos that were compared.
    pub pairs: Vec<PhotoPair>,
    /// The matches of those that belong together.
    pub links: Vec<PairLink>,
    /// What was matched of these pairs and contradicts their links, as it moved or is matched by chance.
    pub outliers: Vec<([usize; 2], Vec<Match>)>,
    /// The photos that all of this is of, where they are not those given.
    pub undistorted: Option<UndistortedPhotos>,
}

/// Finds the geometry of photos.
pub(super) async fn locate(
    given: &[Photo<'_>],
    options: &ManyOptions,
    budget: &mut Budget<'_>,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Located> {
    let stages = &options.stages;
    let images: Vec<ImageView<'_>> = given.iter().map(|photo| photo.image).collect();
    let mut features = features(&images, stages, workers, observer).await?;
    timer.end(Stage::Detect, observer);
    let distortion = options.distortion.filter(|known| *known != 0.0);
    let mut undistorted = match distortion {
        Some(known) => Some(UndistortedPhotos::of(given, &mut features, Distortion(known), budget)?),
        None => None,
    };
    let mut graph = pair_graph(&features, stages, workers, observer).await?;
    timer.end(Stage::Match, observer);

    observer.subject(Subject::All);
    report(observer, Stage::Estimate, 0.0)?;
    let cameras: Option<Vec<Camera>> = given.iter().map(|photo| photo.camera).collect();
    let group = match &cameras {
        Some(_) => (0..given.len()).collect(),
        None => largest_group(given.len(), options.reference, &graph.links),
    };
    if group.len() < 2 {
        return Err(unmatched(&graph, options.reference));
    }
    let mut codes = codes(given.len(), &group, &graph.links);
    let lens = |photo: &Photo<'_>| Lens { size: photo.image.size(), focal: photo.focal.or(stages.estimate.focal) };
    let lenses: Vec<Lens> = UndistortedPhotos::shown(&undistorted, given).iter().map(lens).collect();
    let links: Vec<PairLink> = graph.links.iter().filter(|link| group.contains(&link.photos[0])).cloned().collect();
    let mut geometry = match &cameras {
        Some(cameras) => MultiView::given(&lenses, cameras, &links),
        None => multi_view(&lenses, &links, options.reference, options.distortion.is_none()),
    };
    let consistent = |(i, link): (usize, PairLink)| (!geometry.contradicting.contains(&i)).then_some(link);
    let mut links: Vec<PairLink> = links.into_iter().enumerate().filter_map(consistent).collect();
    if let Some(distortion) = geometry.distortion() {
        let found = UndistortedPhotos::of(given, &mut features, distortion, budget)?;
        found.move_matches(&mut links);
        geometry.undistort(&found.frames(), &links);
        undistorted = Some(found);
    }
    if stages.features.guided && geometry.kind == MultiViewKind::Cameras {
        let images: Vec<ImageView<'_>> =
            UndistortedPhotos::shown(&undistorted, given).iter().map(|photo| photo.image).collect();
        let matching = &stages.features.matching;
        let again = &mut Portion::of_stage(observer, Stage::Estimate, 0.0, 0.5);
        links = more_matches(&images, &features, &graph.pairs, &links, &geometry, matching, again)?;
        refine(&images, &links, &mut geometry, &mut Portion::of_stage(observer, Stage::Estimate, 0.5, 1.0))?;
    }
    for pair in graph.pairs.iter_mut().filter(|pair| group.contains(&pair.photos[0])) {
        pair.linked = links.iter().any(|link| link.photos == pair.photos);
    }
    let placed: Vec<usize> = group.iter().copied().filter(|&photo| geometry.is_placed(photo)).collect();
    group.iter().filter(|photo| !placed.contains(photo)).for_each(|&photo| codes[photo] = PhotoCode::NoPose);
    timer.end(Stage::Estimate, observer);
    let outliers = graph.outliers.into_iter().filter(|(photos, _)| links.iter().any(|link| link.photos == *photos));
    let outliers = outliers.map(|(photos, pairs)| {
        let [a, b] = photos.map(|photo| &features[photo]);
        let pairs: Vec<Pair> = pairs.into_iter().map(|[target, reference]| Pair { target, reference }).collect();
        (photos, matches_of(a, b, &pairs))
    });
    let outliers = outliers.collect();
    Ok(Located { geometry, placed, codes, pairs: graph.pairs, links, outliers, undistorted })
}

/// Of all photos, before any is given up for its place.
fn codes(count: usize, group: &[usize], links: &[PairLink]) -> Vec<PhotoCode> {
    let code = |photo: usize| {
        if group.contains(&photo) {
            PhotoCode::Used
        } else if links.iter().any(|link| link.photos.contains(&photo)) {
            PhotoCode::OtherGroup
        } else {
            PhotoCode::NoMatches
        }
    };
    (0..count).map(code).collect()
}

/// The error of photos that do not belong together, by the pair that comes closest; of a `reference` that matches none, by its
/// pairs.
fn unmatched(graph: &Graph, reference: Option<usize>) -> Box<Error> {
    let own = |pair: &&PhotoPair| reference.is_none_or(|reference| pair.photos.contains(&reference));
    let best = graph.pairs.iter().filter(own).max_by_key(|pair| (pair.inliers, pair.matches));
    let (matches, inliers) = best.map_or((0, 0), |pair| (pair.matches, pair.inliers));
    Error::NoConsensus { matches, inliers, needed: FEWEST }.into()
}
