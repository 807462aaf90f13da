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
mod exposure;
mod given;
mod graph;
mod guided;
mod labelling;
mod locate;
pub(crate) mod memory;
mod picture;
mod plane_parts;
mod planes;
mod result;
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

use super::align::void_distance;
use super::options::Options;
use super::timer::StageTimer;
use super::{Crops, Detect};
use crate::mosaic::{Added, Composition, Exposure, FillGuide, FillMethod, Layer, crop, fill};
use crate::observer::{Observer, Portion, Subject};
use crate::report::Warning;
use crate::warp::{Distorted, WarpJob, WarpOptions, Warped, warp_within};
use crate::workers::{Workers, without_waiting};
use crate::{Error, Image, InverseDepth, Rect, Result, Stage, View};
use align::align_timed;
use check::check;
use exposure::joint_gains;
use memory::Budget;
use undistorted::UndistortedPhotos;
use visible::VisiblePhotos;

/// Bounds that nothing lies beyond.
const EVERYTHING: [i64; 4] = [i64::MIN / 4, i64::MIN / 4, i64::MAX / 4, i64::MAX / 4];

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
    let mut budget = check(photos, options)?;
    let stages = &options.stages;
    let mut timer = StageTimer::start(observer);
    let visible = VisiblePhotos::of(photos)?;
    let given = &visible.photos(photos)[..];
    let mut alignment = align_timed(given, options, &mut budget, workers, observer, &mut timer).await?;
    let undistorted = alignment.undistorted.take();
    let distortion = undistorted.as_ref().map_or(0.0, |undistorted| undistorted.distortion.0);
    let photos = &UndistortedPhotos::shown(&undistorted, given)[..];
    let distorted: Option<Vec<Distorted<'_>>> = undistorted.as_ref().map(|undistorted| undistorted.distorted(given));
    let (reference, order) = (alignment.reference, alignment.order.clone());
    let mut reports = alignment.reports();
    let gains = match stages.blend.exposure {
        Exposure::Off => vec![None; photos.len()],
        _ => joint_gains(photos, &alignment)?,
    };
    let layer = |photo: usize| Layer { label: (photo + 1) as u8, gains: gains[photo] };
    let mut painting = Painting {
        alignment: &alignment,
        photos,
        distorted: distorted.as_deref(),
        options: stages,
        budget: &budget,
        composition: None,
    };
    let mut clipped = false;
    let count = order.len() as f32;
    for (i, &photo) in order.iter().enumerate() {
        observer.subject(Subject::Photo(photo));
        let (from, to) = (i as f32 / count, (i + 1) as f32 / count);
        let warped = painting.render(photo, &mut Portion::new(observer, from, to))?;
        timer.end(Stage::Warp, observer);
        clipped |= warped.as_ref().is_some_and(|(warped, _)| warped.clipped);
        let added = painting.add(warped, photo, layer(photo), &mut Portion::new(observer, from, to))?;
        match added {
            Some(added) => (reports[photo].gains, reports[photo].extent) = (added.gains, Some(added.extent)),
            None => reports[photo].code = PhotoCode::NotVisible,
        }
        timer.end(Stage::Blend, observer);
    }
    observer.subject(Subject::All);
    let Some(composition) = painting.composition else { return Err(Error::NoOverlap { pixels: 0 }.into()) };
    let voids = composition.voids()?;
    let Composition { mut image, labels, offset, depth, .. } = composition;
    if let Some(options) = &stages.fill {
        // Only exemplar filling uses depth, to tell background from foreground. There is no one epipole.
        let guided = options.method == FillMethod::Exemplar && alignment.depth(reference).is_some();
        let guide = guided.then_some(FillGuide { depth, epipole: [0.0; 3] });
        fill(&mut image, &voids, guide.as_ref(), options, observer)?;
    }
    let crops = Crops { inner: crop::inner(&image)?, bounds: crop::bounds(&image) };
    timer.end(Stage::Fill, observer);
    let warnings = [
        (clipped, Warning::CanvasClipped),
        (alignment.ignores_depth(photos), Warning::DepthInconsistent),
        (alignment.ignores_parallax, Warning::ParallaxIgnored),
    ];
    if stages.output_depth {
        let mut images = undistorted.into_iter().flat_map(UndistortedPhotos::into_images);
        for (photo, report) in reports.iter_mut().enumerate() {
            let image = images.next();
            if report.code == PhotoCode::Used {
                report.map = alignment.take_map(photo, image);
            }
        }
    }
    Ok(StitchedMany {
        image,
        labels,
        voids,
        offset,
        reference,
        projection: alignment.picture.projection(),
        distortion,
        geometry: alignment.geometry.kind,
        photos: reports,
        pairs: alignment.pairs,
        crops,
        warnings: warnings.into_iter().filter(|(applies, _)| *applies).map(|(_, warning)| warning).collect(),
        times: timer.into_times(),
    })
}

/// The picture as it grows.
struct Painting<'a> {
    alignment: &'a ManyAlignment,
    photos: &'a [Photo<'a>],
    /// The same with the distortion of their lens, unless there is none.
    distorted: Option<&'a [Distorted<'a>]>,
    options: &'a Options,
    budget: &'a Budget<'a>,
    /// Nothing at first.
    composition: Option<Composition>,
}

impl Painting<'_> {
    /// Renders a photo next to what is there already, and says where the origin of its canvas is in the view; `None` when nothing of
    /// it lands there, or it needs no rendering.
    fn render(&self, photo: usize, observer: &mut dyn Observer) -> Result<Option<(Warped, [i64; 2])>> {
        let Self { alignment: ManyAlignment { geometry, picture, .. }, photos, distorted, .. } = *self;
        let sizes: Vec<_> = photos.iter().map(|photo| photo.image.size()).collect();
        let (base, depth, at) = match &self.composition {
            None if picture.is_plane() && distorted.is_none() => return Ok(None),
            None => {
                // On a plane canvases are as large as the reference allows.
                let (width, height) = if picture.is_plane() { sizes[photo] } else { (1, 1) };
                (Image::transparent(width, height)?, InverseDepth::constant(0.0, width, height)?, [0; 2])
            }
            // All of it, where it is not clear how much is needed.
            Some(there) => there.part(picture.bounds(photo, &sizes, geometry).unwrap_or(EVERYTHING))?,
        };
        let Some([forward, reverse]) = picture.models(geometry, photo, at) else { return Ok(None) };
        let error = self.alignment.prediction_error(photo);
        let options = WarpOptions {
            void_distance: void_distance(error, sizes[photo], self.options.warp.void_distance),
            depth: true,
            ..self.options.warp.clone()
        };
        let job = WarpJob {
            target: View { image: photos[photo].image, depth: self.alignment.depth(photo) },
            reference: View { image: base.view(), depth: Some(&depth) },
            forward: &forward,
            reverse: &reverse,
            surface: picture.surface_at(at),
            limits: picture
                .limits(photo, &sizes, geometry, self.options.warp.canvas_limit)
                .map(|limits| limits.relative_to(at)),
            distorted: distorted.and_then(|distorted| distorted.get(photo).copied()),
        };
        match warp_within(&job, &options, &|canvas| self.budget.check(canvas), observer) {
            Err(error) if matches!(*error, Error::NoOverlap { .. }) => Ok(None),
            warped => warped.map(|warped| Some((warped, at))),
        }
    }

    /// Adds a photo; `None` when nothing of it is visible.
    fn add(
        &mut self,
        warped: Option<(Warped, [i64; 2])>,
        photo: usize,
        layer: Layer,
        observer: &mut dyn Observer,
    ) -> Result<Option<Added>> {
        let image = self.photos[photo].image;
        let Some(composition) = &mut self.composition else {
            let first = match warped {
                Some((warped, _)) => Composition::of_warped(warped, image.size(), layer.label)?,
                None => Composition::of(image, self.alignment.depth(photo), layer.label)?,
            };
            let (left, top) = first.offset;
            let Some(drawn) = crop::bounds(&first.image) else { return Ok(None) };
            let Rect { width, height, .. } = drawn;
            let extent = [drawn.x as i64 - left as i64, drawn.y as i64 - top as i64, width as i64, height as i64];
            self.composition = Some(first);
            return Ok(Some(Added { gains: [1.0; 3], overlap: 0, extent }));
        };
        let Some((warped, at)) = warped else { return Ok(None) };
        self.budget.check(composition.size_with(&warped, at))?;
        composition.add(&warped, at, layer, &self.options.blend, observer)
    }
}
