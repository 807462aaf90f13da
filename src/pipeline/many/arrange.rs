//! Which photos can be shown in whose view, and on what: with a geometry, and the depth that it gives them.

use super::depth::{PhotoDepth, depths};
use super::picture::ManyPicture;
use super::result::Photo;
use super::view;
use super::{ManyOptions, ManyWorkers};
use crate::geometry::{MultiView, PairLink};
use crate::observer::Observer;
use crate::warp::Projection;
use crate::{Result, View};

/// A photo that its depth distorts by more than this, as a mean anisotropy, looks worse than the ghosts of cameras that only turned. Of nine real
/// sets that these explain roughly three have such a photo, by 0.34 and more; the others have none by more than 0.09.
const MOST_DISTORTED: f64 = 0.3;

/// What is shown of photos, and how.
pub(super) struct Arrangement {
    /// The photo in whose view all are shown.
    pub reference: usize,
    /// The photos that can be shown, the reference first.
    pub used: Vec<usize>,
    pub picture: ManyPicture,
    pub depths: Vec<Option<PhotoDepth>>,
}

/// Arranges the photos that are `placed`.
pub(super) async fn arrange(
    photos: &[Photo<'_>],
    placed: &[usize],
    geometry: &MultiView,
    links: &[PairLink],
    options: &ManyOptions,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
) -> Result<Arrangement> {
    let stages = &options.stages;
    let sizes = sizes(photos);
    let plane = stages.projection == Some(Projection::Plane);
    let reference = options.reference.unwrap_or_else(|| view::middle(&sizes, placed, geometry, plane));
    let picture = ManyPicture::choose(stages.projection, reference, placed, &sizes, geometry);
    let others = placed.iter().copied().filter(|photo| *photo != reference);
    let shown = others.filter(|&photo| view::can_be_shown(&picture, photo, &sizes, geometry));
    let used: Vec<usize> = std::iter::once(reference).chain(shown).collect();
    let views: Vec<View<'_>> = photos.iter().map(Photo::view).collect();
    let refine = stages.refine.as_ref();
    let depths = depths(&views, &used, geometry, links, refine, workers, observer).await?;
    // What is farther than most of a photo may be stretched where that is not.
    let suits =
        |photo: &usize| depths[*photo].as_ref().is_none_or(|depth| picture.suits(*photo, &depth.map, &sizes, geometry));
    let around = match stages.projection {
        None if picture.is_plane() && !used.iter().all(suits) => {
            ManyPicture::around(None, reference, &used, &sizes, geometry)
        }
        _ => None,
    };
    Ok(Arrangement { reference, used, picture: around.unwrap_or(picture), depths })
}

impl Arrangement {
    /// Whether a photo looks distorted by depth that was found, not given.
    pub fn is_distorted(&self, photos: &[Photo<'_>], geometry: &MultiView) -> bool {
        let sizes = sizes(photos);
        let distorted = |(photo, depth): (usize, &PhotoDepth)| {
            self.picture.anisotropy_by_parallax(photo, &depth.map, &sizes, geometry) > MOST_DISTORTED
        };
        let known = || self.used.iter().filter_map(|&photo| Some((photo, self.depths[photo].as_ref()?)));
        known().all(|(_, depth)| !depth.given) && known().any(distorted)
    }
}

fn sizes(photos: &[Photo<'_>]) -> Vec<(usize, usize)> {
    photos.iter().map(|photo| photo.image.size()).collect()
}
