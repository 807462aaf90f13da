//! The first half: features → pair graph → geometry → depth.

use nalgebra::Matrix3;

use super::depth::{PhotoDepth, depths};
use super::graph::{FEWEST, Graph, PhotoPair, features, largest_group, matched, pair_graph};
use super::guided::{more_matches, refine};
use super::memory::Budget;
use super::picture::ManyPicture;
use super::result::{Photo, PhotoCode, PhotoMap, PhotoReport};
use super::undistorted::UndistortedPhotos;
use super::visible::VisiblePhotos;
use super::{ManyOptions, view};
use crate::features::Features;
use crate::geometry::{Camera, Distortion, Lens, Model, MultiView, MultiViewKind, PairLink, multi_view};
use crate::image::check_size;
use crate::observer::{Observer, Subject, report};
use crate::pipeline::timer::StageTimer;
use crate::warp::Projection;
use crate::{Error, Image, ImageView, InverseDepth, Result, Stage, View};

/// Fewest and most photos.
const PHOTOS: std::ops::RangeInclusive<usize> = 2..=30;

/// Where the photos belong: what rendering needs besides them.
#[derive(Debug, Clone)]
pub struct ManyAlignment {
    /// The photo in whose view all are shown.
    pub reference: usize,
    /// The photos to show, from the reference, which is the first, outward.
    pub order: Vec<usize>,
    /// What is to become of each photo.
    pub codes: Vec<PhotoCode>,
    /// The pairs of photos that were compared.
    pub pairs: Vec<PhotoPair>,
    pub(super) picture: ManyPicture,
    pub(super) geometry: MultiView,
    pub(super) depths: Vec<Option<PhotoDepth>>,
    /// The photos that all of this is of, where they are not those given.
    pub(super) undistorted: Option<UndistortedPhotos>,
}

/// Finds the place of each photo, and its inverse depth.
///
/// # Errors
/// `invalid-argument` for fewer than two or more than thirty photos, a reference that is none of them, a distortion beyond −1 to 1, or a
/// focal length that is no positive number; `too-large` when the predicted peak exceeds
/// [`WarpOptions::max_bytes`](crate::warp::WarpOptions::max_bytes), before anything is allocated; `no-consensus` when no two
/// photos match, or the reference matches none; those of [`detect`](crate::features::detect),
/// [`match_features`](crate::features::match_features), [`estimate`](crate::geometry::estimate) and
/// [`refine`](crate::depth::refine).
pub fn align_many(photos: &[Photo<'_>], options: &ManyOptions, observer: &mut dyn Observer) -> Result<ManyAlignment> {
    let mut budget = check(photos, options)?;
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePhotos::of(photos)?;
    align_timed(&visible.photos(photos), None, options, &mut budget, observer, &mut timer)
}

pub(super) fn align_timed(
    given: &[Photo<'_>],
    known: Option<Vec<Features>>,
    options: &ManyOptions,
    budget: &mut Budget<'_>,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<ManyAlignment> {
    let stages = &options.stages;
    let images: Vec<ImageView<'_>> = given.iter().map(|photo| photo.image).collect();
    let mut features = match known {
        Some(known) => known.into_iter().map(matched).collect(),
        None => {
            let found = features(&images, stages, observer)?;
            timer.end(Stage::Detect, observer);
            found
        }
    };
    let mut undistorted = None;
    if let Some(known) = options.distortion.filter(|known| *known != 0.0) {
        let known = UndistortedPhotos::of(given, Distortion(known), budget)?;
        known.move_features(&mut features);
        undistorted = Some(known);
    }
    let mut graph = pair_graph(&features, stages, observer)?;
    timer.end(Stage::Match, observer);
    observer.subject(Subject::All);
    report(observer, Stage::Estimate, 0.0)?;
    let cameras: Option<Vec<Camera>> = given.iter().map(|photo| photo.camera).collect();
    let group = match &cameras {
        Some(_) => (0..images.len()).collect(),
        None => largest_group(images.len(), options.reference, &graph.links),
    };
    if group.len() < 2 {
        return Err(unmatched(&graph, options.reference));
    }
    let mut codes = codes(images.len(), &group, &graph.links);
    let lens = |photo: &Photo<'_>| Lens { size: photo.image.size(), focal: photo.focal.or(stages.estimate.focal) };
    let lenses: Vec<Lens> = UndistortedPhotos::shown(&undistorted, given).iter().map(lens).collect();
    let mut inside: Vec<PairLink> =
        graph.links.iter().filter(|link| group.contains(&link.photos[0])).cloned().collect();
    let root = options.reference.unwrap_or(group[0]);
    let mut geometry = match &cameras {
        Some(cameras) => MultiView::given(&lenses, cameras, &inside),
        None => multi_view(&lenses, &inside, root, options.distortion.is_none()),
    };
    for link in geometry.contradicting.iter().filter_map(|&i| inside.get(i)) {
        graph.pairs.iter_mut().filter(|pair| pair.photos == link.photos).for_each(|pair| pair.linked = false);
    }
    if let Some(distortion) = geometry.distortion() {
        let found = UndistortedPhotos::of(given, distortion, budget)?;
        found.move_features(&mut features);
        found.move_matches(&mut inside);
        geometry.undistort(&found.frames(), &inside);
        undistorted = Some(found);
    }
    let photos = UndistortedPhotos::shown(&undistorted, given);
    let images: Vec<ImageView<'_>> = photos.iter().map(|photo| photo.image).collect();
    if stages.features.guided && geometry.kind == MultiViewKind::Cameras {
        let consistent = |(i, link): (usize, PairLink)| (!geometry.contradicting.contains(&i)).then_some(link);
        let links: Vec<PairLink> = inside.into_iter().enumerate().filter_map(consistent).collect();
        let matching = &stages.features.matching;
        inside = more_matches(&images, &features, &graph.pairs, &links, &geometry, matching, observer)?;
        refine(&images, &inside, &mut geometry, observer)?;
    }
    drop(features);
    let placed: Vec<usize> = group.iter().copied().filter(|&photo| geometry.is_placed(photo)).collect();
    group.iter().filter(|photo| !placed.contains(photo)).for_each(|&photo| codes[photo] = PhotoCode::NoPose);
    timer.end(Stage::Estimate, observer);

    let sizes: Vec<(usize, usize)> = images.iter().map(ImageView::size).collect();
    let plane = stages.projection == Some(Projection::Plane);
    let reference = options.reference.unwrap_or_else(|| view::middle(&sizes, &placed, &geometry, plane));
    let picture = ManyPicture::choose(stages.projection, reference, &placed, &sizes, &geometry);
    let mut used = vec![reference];
    for &photo in placed.iter().filter(|photo| **photo != reference) {
        if view::can_be_shown(&picture, photo, &sizes, &geometry) {
            used.push(photo);
        } else {
            codes[photo] = PhotoCode::TooOblique;
        }
    }
    codes[reference] = PhotoCode::Used;
    let views: Vec<View<'_>> = photos.iter().map(Photo::view).collect();
    let depths = depths(&views, &used, reference, &geometry, &inside, stages.refine.as_ref(), observer)?;
    timer.end(Stage::Depth, observer);
    // What is farther than most of a photo may be stretched where that is not.
    let suits = |photo: &usize| {
        depths[*photo].as_ref().is_none_or(|depth| picture.suits(*photo, &depth.map, &sizes, &geometry))
    };
    let around = match stages.projection {
        None if picture.is_plane() && !used.iter().all(suits) => {
            ManyPicture::around(None, reference, &used, &sizes, &geometry)
        }
        _ => None,
    };
    let picture = around.unwrap_or(picture);
    let order = view::outward(reference, &used, &inside);
    Ok(ManyAlignment { reference, order, codes, pairs: graph.pairs, picture, geometry, depths, undistorted })
}

impl ManyAlignment {
    /// The map from a photo into the reference's view, by its inverse depth, and that depth: `None` where the map has no
    /// parallax. `None` for a photo without a place.
    pub fn map(&self, photo: usize) -> Option<(Model, Option<&InverseDepth>)> {
        let model = self.geometry.model([photo, self.reference])?;
        Some((model, self.depth(photo)))
    }

    /// What became of a photo so far.
    pub fn report(&self, photo: usize) -> PhotoReport {
        let known = self.geometry.kind != MultiViewKind::Homographies;
        let camera = self.geometry.camera(photo).filter(|_| known);
        PhotoReport {
            code: self.codes[photo],
            camera,
            focal: camera.and_then(|_| self.geometry.focal(photo)),
            error: self.geometry.error(photo),
            gains: [1.0; 3],
            extent: None,
            map: None,
        }
    }

    /// As [`ManyAlignment::map`], for the result.
    pub(super) fn take_map(&mut self, photo: usize, undistorted: Option<Image>) -> Option<PhotoMap> {
        let itself = Model::homography(Matrix3::identity());
        let towards = |pair: [usize; 2]| if pair[0] == pair[1] { Some(itself) } else { self.geometry.model(pair) };
        let [forward, reverse] = [[photo, self.reference], [self.reference, photo]].map(towards);
        Some(PhotoMap {
            forward: forward?,
            reverse: reverse?,
            depth: self.depths[photo].take().map(|depth| depth.map),
            undistorted,
        })
    }

    /// Whether a depth map was given of a photo in the picture that contradicts what photos show.
    pub(super) fn ignores_depth(&self, photos: &[Photo<'_>]) -> bool {
        let ignored = |photo: &usize| {
            photos[*photo].depth.is_some() && self.depths[*photo].as_ref().is_none_or(|depth| !depth.given)
        };
        self.geometry.kind == MultiViewKind::Cameras && self.order.iter().any(ignored)
    }

    pub(super) fn depth(&self, photo: usize) -> Option<&InverseDepth> {
        self.depths[photo].as_ref().map(|depth| &depth.map)
    }

    /// How far a photo's landmarks miss those left out of its map, in pixels.
    pub(super) fn prediction_error(&self, photo: usize) -> f64 {
        self.depths[photo].as_ref().map_or(0.0, |depth| depth.prediction_error)
    }
}

/// Refuses what cannot be stitched; the memory that the rest may take.
pub(super) fn check<'a>(photos: &[Photo<'_>], options: &'a ManyOptions) -> Result<Budget<'a>> {
    for value in photos.iter().filter_map(|photo| photo.focal).chain(options.stages.estimate.focal) {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::InvalidArgument { name: "focalLength", expected: "a positive number", value }.into());
        }
    }
    check_cameras(photos)?;
    for (photo, depth) in photos.iter().filter_map(|photo| Some((photo, photo.depth?))) {
        check_size("depth", depth.size(), photo.image.size())?;
    }
    let mut budget = check_sizes(photos.iter().map(|photo| photo.image.size()), options)?;
    let masked = photos.iter().map(|photo| photo.image).filter(ImageView::is_masked);
    masked.for_each(|image| budget.add_masked(image.size()));
    photos.iter().filter(|photo| photo.depth.is_some()).for_each(|photo| budget.add_depth(photo.image.size()));
    budget.check((0, 0))?;
    Ok(budget)
}

/// How far a rotation may be from one: the largest element of RᵀR − I.
const ROTATION: f64 = 1e-3;

/// Refuses cameras of some photos alone, or without a focal length, and what is no rotation.
fn check_cameras(photos: &[Photo<'_>]) -> Result<()> {
    let cameras: Vec<Camera> = photos.iter().filter_map(|photo| photo.camera).collect();
    if cameras.is_empty() {
        return Ok(());
    }
    let invalid = |name, expected, value| Err(Error::InvalidArgument { name, expected, value }.into());
    if cameras.len() < photos.len() {
        return invalid("camera", "given for every photo or for none", cameras.len() as f64);
    }
    if photos.iter().any(|photo| photo.focal.is_none()) {
        return invalid("focalLength", "given with every camera", f64::NAN);
    }
    for Camera { rotation, translation } in cameras {
        let off = (rotation.transpose() * rotation - Matrix3::identity()).amax();
        if off.is_nan() || off > ROTATION || rotation.determinant() < 0.0 {
            return invalid("rotation", "a rotation: orthogonal, with determinant 1", rotation.determinant());
        }
        if let Some(value) = translation.iter().copied().find(|value| !value.is_finite()) {
            return invalid("translation", "three finite numbers", value);
        }
    }
    Ok(())
}

/// As [`check`], by the photos' sizes alone.
pub(crate) fn check_sizes(
    sizes: impl ExactSizeIterator<Item = (usize, usize)>,
    options: &ManyOptions,
) -> Result<Budget<'_>> {
    let count = sizes.len();
    check_count(count)?;
    if let Some(reference) = options.reference.filter(|reference| *reference >= count) {
        return Err(Error::InvalidArgument {
            name: "reference",
            expected: "the index of a photo",
            value: reference as f64,
        }
        .into());
    }
    if let Some(value) = options.distortion.filter(|known| known.is_nan() || known.abs() > Distortion::MOST) {
        return Err(Error::InvalidArgument { name: "distortion", expected: "from -1 to 1", value }.into());
    }
    let budget = Budget::of(sizes, &options.stages);
    budget.check((0, 0))?;
    Ok(budget)
}

/// Refuses too few photos, and too many.
pub(crate) fn check_count(count: usize) -> Result<()> {
    if PHOTOS.contains(&count) {
        return Ok(());
    }
    Err(Error::InvalidArgument { name: "photos", expected: "from 2 to 30 photos", value: count as f64 }.into())
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
