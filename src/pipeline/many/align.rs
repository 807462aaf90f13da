//! The first half: features → pair graph → geometry → depth, and which photos can be shown in whose view.

use super::arrange::{Arrangement, arrange};
use super::check::check;
use super::depth::PhotoDepth;
use super::graph::PhotoPair;
use super::locate::{Located, locate};
use super::memory::Budget;
use super::picture::ManyPicture;
use super::result::{Photo, PhotoCode, PhotoReport};
use super::undistorted::UndistortedPhotos;
use super::visible::VisiblePhotos;
use super::{ManyOptions, ManyWorkers, view};
use crate::geometry::{Distortion, Match, Model, MultiView, MultiViewKind};
use crate::observer::{Observer, Portion};
use crate::pipeline::picture::Size;
use crate::pipeline::timer::StageTimer;
use crate::workers::without_waiting;
use crate::{InverseDepth, Result, Stage};

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
    /// Whether the cameras stand in different places, but are shown as if they had only turned, as that looks better.
    pub ignores_parallax: bool,
    /// What was matched of pairs that belong together, whether the geometry explains it or not.
    pub(super) matches: Vec<([usize; 2], Vec<Match>)>,
    pub(super) picture: ManyPicture,
    pub(super) geometry: MultiView,
    pub(super) depths: Vec<Option<PhotoDepth>>,
    /// That of the photos' lens, unless there is none.
    pub(super) distortion: Option<Distortion>,
    /// The photos that all of this is of, where they are not those given.
    pub(super) undistorted: Option<UndistortedPhotos>,
    /// Their sizes.
    pub(super) sizes: Vec<Size>,
}

/// Finds the place of each photo, and its inverse depth: in pixels of the photos, however large they are.
///
/// # Errors
/// `invalid-argument` for options of any stage out of range, fewer than two or more than thirty photos, a photo that is all masked, a reference
/// that is none of them, a distortion beyond −1 to 1, a focal length that is no positive number, cameras of some photos only or without focal length, a matrix that is no rotation or a
/// translation that is not finite; `size-mismatch` for depth of another size than its photo's; `too-large` when the predicted peak exceeds
/// [`WarpOptions::max_bytes`](crate::warp::WarpOptions::max_bytes), before anything is allocated; `no-consensus` when no two
/// photos match, or the reference matches none; those of [`detect`](crate::features::detect),
/// [`match_features`](crate::features::match_features), [`estimate`](crate::geometry::estimate) and
/// [`refine`](crate::depth::refine).
pub fn align_many(photos: &[Photo<'_>], options: &ManyOptions, observer: &mut dyn Observer) -> Result<ManyAlignment> {
    let mut budget = check(photos, options, false)?;
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePhotos::of(photos)?;
    let photos = visible.photos(photos);
    without_waiting(align_timed(&photos, options, &mut budget, &(), observer, &mut timer))
}

/// As [`align_many`], of photos that were checked.
pub(super) async fn align_timed(
    given: &[Photo<'_>],
    options: &ManyOptions,
    budget: &mut Budget<'_>,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<ManyAlignment> {
    let located = locate(given, options, budget, workers, observer, timer).await?;
    let Located { mut geometry, placed, mut codes, pairs, links, outliers, undistorted } = located;
    let photos = UndistortedPhotos::shown(&undistorted, given);
    let measuring = &mut Portion::of_stage(observer, Stage::Depth, 0.0, 1.0);
    let mut arranged = arrange(&photos, &placed, &geometry, &links, options, workers, measuring).await?;
    let ignores_parallax = arranged.is_distorted(&photos, &geometry) && geometry.ignore_parallax();
    if ignores_parallax {
        // Without parallax there is no depth to find.
        arranged = arrange(&photos, &placed, &geometry, &links, options, workers, &mut ()).await?;
    }
    timer.end(Stage::Depth, observer);
    let Arrangement { reference, used, picture, depths } = arranged;
    for &photo in &placed {
        codes[photo] = if used.contains(&photo) { PhotoCode::Used } else { PhotoCode::TooOblique };
    }
    let order = view::outward(reference, &used, &links);
    let sizes = photos.iter().map(|photo| photo.image.size()).collect();
    let matches = links.into_iter().map(|link| (link.photos, link.matches)).chain(outliers).collect();
    let distortion = undistorted.as_ref().map(|undistorted| undistorted.distortion);
    Ok(ManyAlignment {
        reference,
        order,
        codes,
        pairs,
        matches,
        ignores_parallax,
        picture,
        geometry,
        depths,
        distortion,
        undistorted,
        sizes,
    })
}

impl ManyAlignment {
    /// The map from a photo into the reference's view, by its inverse depth, and that depth: `None` where the map has no
    /// parallax. `None` for a photo without a place.
    pub fn map(&self, photo: usize) -> Option<(Model, Option<&InverseDepth>)> {
        self.codes.get(photo)?;
        let model = self.geometry.model([photo, self.reference])?;
        Some((model, self.depth(photo)))
    }

    /// What became of each photo so far.
    pub fn reports(&self) -> Vec<PhotoReport> {
        let known = self.geometry.kind != MultiViewKind::Homographies;
        let report = |(photo, &code)| {
            let camera = self.geometry.camera(photo).filter(|_| known);
            PhotoReport {
                code,
                camera,
                focal: camera.and_then(|_| self.geometry.focal(photo)),
                error: self.geometry.error(photo),
                gains: [1.0; 3],
                extent: None,
                map: None,
            }
        };
        self.codes.iter().enumerate().map(report).collect()
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
