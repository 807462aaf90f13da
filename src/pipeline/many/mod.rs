//! From two to thirty photos to one picture: features → pair graph → geometry → depth → warp → mosaic.
//!
//! Every photo is matched with others (`graph.rs`), one geometry explains all of them (`geometry/multi_view`), and each gets
//! inverse depth in the unit of the cameras (`depth.rs`): that is [`align_many`]. [`stitch_many`] renders each photo once, from
//! the original, into the reference's view, and puts one after another together, from the reference outward
//! ([`Composition`]).

mod align;
mod arrange;
mod carried;
mod check;
mod depth;
mod drawing;
mod exposure;
mod given;
mod graph;
mod guided;
mod labelling;
mod locate;
pub(crate) mod memory;
mod picture;
mod placement;
mod plane_parts;
mod planes;
mod reduced;
mod result;
mod surface;
mod undistorted;
mod view;
mod views;
mod visible;

pub use align::{ManyAlignment, align_many};
#[cfg(all(target_arch = "wasm32", feature = "wasm-many"))]
pub(crate) use check::{check_count, check_sizes};
pub(crate) use depth::MatchStereo;
pub(crate) use graph::MatchPhotos;
#[cfg(all(target_arch = "wasm32", feature = "wasm-many"))]
pub(crate) use graph::MatchedPhotos;
pub use graph::PhotoPair;
pub use result::{Photo, PhotoCode, PhotoMap, PhotoReport, StitchedMany};

use super::halved::factor;
use super::options::Options;
use super::picture::Size;
use super::timer::StageTimer;
use super::{Crops, Detect};
use crate::mosaic::{Composition, Exposure, FillGuide, FillMethod, crop, fill, lift_shadows};
use crate::observer::Observer;
use crate::report::Warning;
use crate::workers::{Workers, without_waiting};
use crate::{Result, Stage};
use align::align_timed;
use check::check;
use drawing::{Drawn, draw_as_large_as_fits};
use exposure::{JointExposure, joint_exposure};
use placement::Placement;
use reduced::{ReducedPhotos, options_for};
use undistorted::UndistortedPhotos;
use visible::VisiblePhotos;

/// Options of [`stitch_many`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ManyOptions {
    /// Those of the stages. [`Options::without_depth`] plays no part; the focal length of [`EstimateOptions`](crate::geometry::EstimateOptions) is that of photos without one.
    pub stages: Options,
    /// Index of the photo in whose view all are shown; `None` for the one in the middle.
    pub reference: Option<usize>,
    /// The [distortion](StitchedMany::distortion) of the lens, from −1 to 1. With `None` it is estimated, but with cameras that are given it
    /// is 0.
    pub distortion: Option<f64>,
}

/// Who performs the tasks of many photos.
pub(crate) trait ManyWorkers:
    for<'a> Workers<Detect<'a>> + for<'a> Workers<MatchPhotos<'a>> + for<'a> Workers<MatchStereo<'a>>
{
}

impl<W> ManyWorkers for W where
    W: for<'a> Workers<Detect<'a>> + for<'a> Workers<MatchPhotos<'a>> + for<'a> Workers<MatchStereo<'a>>
{
}

/// Stitches photos of one scene, taken from wherever, in any order.
///
/// Masked pixels ([`ImageView`](crate::ImageView)) take part in nothing. Photos that do not belong, or cannot be shown, are left out, and
/// [`StitchedMany::photos`] says why.
///
/// # Errors
/// Those of [`align_many`]; `too-large` also once the size of the canvas is known; those of [`warp`](crate::warp::warp) and [`fill`].
pub fn stitch_many(photos: &[Photo<'_>], options: &ManyOptions, observer: &mut dyn Observer) -> Result<StitchedMany> {
    without_waiting(stitch_many_with_workers(photos, options, &(), observer))
}

/// As [`stitch_many`], with tasks left to workers.
pub(crate) async fn stitch_many_with_workers(
    photos: &[Photo<'_>],
    options: &ManyOptions,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
) -> Result<StitchedMany> {
    let mut budget = check(photos, options, true)?;
    let (stages, halvings) = (&options.stages, budget.halvings);
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePhotos::of(photos)?;
    let given = &visible.photos(photos)[..];
    let reduced = ReducedPhotos::of(given, halvings)?;
    let aligned = &reduced.photos(given)[..];
    let aligning = &options_for(options, halvings);
    let mut alignment = align_timed(aligned, aligning, &mut budget, workers, observer, &mut timer).await?;
    let JointExposure { gains, lift } = match stages.blend.exposure {
        Exposure::Off => JointExposure { gains: vec![None; photos.len()], lift: 1.0 },
        _ => joint_exposure(&UndistortedPhotos::shown(&alignment.undistorted, aligned), &alignment)?,
    };
    let drawn = draw_as_large_as_fits(given, reduced, &mut alignment, &gains, &budget, observer, &mut timer)?;
    let Drawn { composition, mut reports, clipped, halvings: drawn } = drawn;
    let voids = composition.voids()?;
    let Composition { mut image, labels, offset, depth, .. } = composition;
    lift_shadows(&mut image, lift)?;
    if let Some(options) = &stages.fill {
        // Only exemplar filling uses depth, to tell background from foreground. There is no one epipole.
        let guided = options.method == FillMethod::Exemplar && alignment.depth(alignment.reference).is_some();
        let guide = guided.then_some(FillGuide { depth, epipole: [0.0; 3] });
        fill(&mut image, &voids, guide.as_ref(), options, observer)?;
    }
    let crops = Crops { inner: crop::inner(&image)?, bounds: crop::bounds(&image) };
    timer.end(Stage::Fill, observer);
    let scale = 1.0 / factor(drawn);
    let warnings = [
        (drawn > 0, Warning::ReducedResolution { scale }),
        (clipped, Warning::CanvasClipped),
        (alignment.ignores_depth(given), Warning::DepthInconsistent),
        (alignment.ignores_parallax, Warning::ParallaxIgnored),
    ];
    for report in &mut reports {
        for pixels in [&mut report.focal, &mut report.error].into_iter().flatten() {
            *pixels *= factor(halvings);
        }
    }
    if stages.output_depth {
        alignment.undistorted = None;
        let sizes: Vec<Size> = given.iter().map(|photo| photo.image.size()).collect();
        let placement = Placement::of(&alignment, &sizes, factor(halvings))?;
        for (photo, report) in reports.iter_mut().enumerate().filter(|(_, report)| report.code == PhotoCode::Used) {
            report.map = placement.take_map(&mut alignment, photo, &given[photo])?;
        }
    }
    Ok(StitchedMany {
        image,
        labels,
        voids,
        offset,
        scale,
        reference: alignment.reference,
        projection: alignment.picture.projection(),
        distortion: alignment.distortion.map_or(0.0, |distortion| distortion.0),
        geometry: alignment.geometry.kind,
        photos: reports,
        pairs: alignment.pairs,
        crops,
        warnings: warnings.into_iter().filter(|(applies, _)| *applies).map(|(_, warning)| warning).collect(),
        times: timer.into_times(),
    })
}
