//! From two to thirty photos to one picture: features → pair graph → geometry → depth → warp → mosaic.
//!
//! Every photo is matched with others (`graph.rs`), one geometry explains all of them (`geometry/multi_view`), and each gets
//! inverse depth in the unit of the cameras (`depth.rs`): that is [`align_many`]. [`stitch_many`] renders each photo once, from
//! the original, into the reference's view, and puts one after another together, from the reference outward
//! ([`Composition`]).

mod align;
mod depth;
mod graph;
pub(crate) mod memory;
mod result;
mod view;

pub use align::{ManyAlignment, align_many};
#[cfg(all(target_arch = "wasm32", feature = "wasm-core"))]
pub(crate) use align::{check_count, check_sizes};
pub use graph::PhotoPair;
pub use result::{Photo, PhotoCode, PhotoReport, StitchedMany};

use super::Crops;
use super::options::Options;
use super::timer::StageTimer;
use crate::mosaic::{Composition, FillGuide, FillMethod, crop, fill};
use crate::observer::{Observer, Portion};
use crate::report::Warning;
use crate::warp::{WarpOptions, Warped, warp_within};
use crate::{Error, Result, Stage, View};
use align::align_timed;
use memory::Budget;

/// Options of [`stitch_many`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ManyOptions {
    /// Those of the stages. [`Options::without_depth`] and [`Options::output_depth`] play no part, as photos have no depth maps of
    /// their own; the focal length of [`EstimateOptions`](crate::geometry::EstimateOptions) is that of photos without one.
    pub stages: Options,
    /// Index of the photo in whose view all are shown; `None` for the one in the middle.
    pub reference: Option<usize>,
}

/// Stitches photos of one scene, taken from wherever, in any order.
///
/// Photos that do not belong, or cannot be shown, are left out, and [`StitchedMany::photos`] says why.
///
/// # Errors
/// Those of [`align_many`]; `too-large` also once the size of the canvas is known; those of [`warp`](crate::warp::warp) and
/// [`fill`].
pub fn stitch_many(photos: &[Photo<'_>], options: &ManyOptions, observer: &mut dyn Observer) -> Result<StitchedMany> {
    let budget = align::check(photos, options)?;
    let stages = &options.stages;
    let mut timer = StageTimer::start(observer);
    let alignment = align_timed(photos, options, observer, &mut timer)?;
    let ManyAlignment { reference, order, .. } = &alignment;
    let mut reports: Vec<PhotoReport> = (0..photos.len()).map(|photo| alignment.report(photo)).collect();
    let label = |photo: usize| (photo + 1) as u8;
    let image = photos[*reference].image;
    // Only exemplar filling uses depth, to distinguish background from foreground.
    let guided = stages.fill.as_ref().is_some_and(|fill| fill.method == FillMethod::Exemplar);
    let depth = alignment.depth(*reference).filter(|_| guided);
    let mut composition = Composition::of(image, depth, label(*reference))?;
    reports[*reference].extent = Some([0, 0, image.width() as i64, image.height() as i64]);
    let mut clipped = false;
    let count = order.len().saturating_sub(1).max(1) as f32;
    for (i, &photo) in order.iter().skip(1).enumerate() {
        let (from, to) = (i as f32 / count, (i + 1) as f32 / count);
        let warped = render(&alignment, photos, photo, stages, &budget, &mut Portion::new(observer, from, to))?;
        timer.end(Stage::Warp, observer);
        let mut added = None;
        if let Some(warped) = &warped {
            clipped |= warped.clipped;
            budget.check(composition.size_with(warped))?;
            added = composition.add(warped, label(photo), &stages.blend, &mut Portion::new(observer, from, to))?;
        }
        match added {
            Some(added) => (reports[photo].gains, reports[photo].extent) = (added.gains, Some(added.extent)),
            None => reports[photo].code = PhotoCode::NotVisible,
        }
        timer.end(Stage::Blend, observer);
    }
    let voids = composition.voids()?;
    let Composition { mut image, labels, offset, depth, .. } = composition;
    if let Some(options) = &stages.fill {
        // There is no one epipole.
        let guide = depth.map(|depth| FillGuide { depth, epipole: [0.0; 3] });
        fill(&mut image, &voids, guide.as_ref(), options, observer)?;
    }
    let crops = Crops { inner: crop::inner(&image)?, bounds: crop::bounds(&image) };
    timer.end(Stage::Fill, observer);
    Ok(StitchedMany {
        image,
        labels,
        voids,
        offset,
        reference: *reference,
        geometry: alignment.geometry.kind,
        photos: reports,
        pairs: alignment.pairs,
        crops,
        warnings: if clipped { vec![Warning::CanvasClipped] } else { Vec::new() },
        times: timer.into_times(),
    })
}

/// Renders a photo in the reference's view; `None` when nothing of it lands on the canvas.
fn render(
    alignment: &ManyAlignment,
    photos: &[Photo<'_>],
    photo: usize,
    options: &Options,
    budget: &Budget<'_>,
    observer: &mut dyn Observer,
) -> Result<Option<Warped>> {
    let reference = alignment.reference;
    let models = [[photo, reference], [reference, photo]].map(|pair| alignment.geometry.model(pair));
    let [Some(forward), Some(reverse)] = models else { return Ok(None) };
    let image = photos[photo].image;
    let view = |photo: usize| View { image: photos[photo].image, depth: alignment.depth(photo) };
    let most = options.warp.void_distance;
    let (w, h) = (image.width() as f64, image.height() as f64);
    let warp = WarpOptions {
        // As of two photos.
        void_distance: (4.0 * alignment.prediction_error(photo) / (w * w + h * h).sqrt()).max(0.5 * most).min(most),
        depth: options.fill.as_ref().is_some_and(|fill| fill.method == FillMethod::Exemplar),
        ..options.warp.clone()
    };
    let check_canvas = |canvas| budget.check(canvas);
    match warp_within(view(photo), view(reference), &forward, &reverse, &warp, &check_canvas, observer) {
        Err(error) if matches!(*error, Error::NoOverlap { .. }) => Ok(None),
        warped => warped.map(Some),
    }
}
