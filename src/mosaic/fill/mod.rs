//! Filling of the mosaic's inner voids.

mod cluster;
mod exemplar;
mod parts;
mod smooth;

use super::FillGuide;
use crate::image::check_size;
use crate::observer::{Observer, Portion, report};
use crate::rect::{bounding_box, extent};
use crate::{Error, Image, Mask, Result, Stage};
use cluster::Clusters;
use parts::{Part, Parts};

/// How voids are filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FillMethod {
    /// Exemplar-based: patches of the surrounding background are copied (PatchMatch); voids only a few pixels wide are filled
    /// smoothly.
    #[default]
    Exemplar,
    /// By coherence transport: colours are propagated from the border along edges.
    Smooth,
}

/// Options of [`fill`].
#[derive(Debug, Clone, PartialEq)]
pub struct FillOptions {
    /// How voids are filled.
    pub method: FillMethod,
    /// Radius in pixels of the neighbourhood that a smoothly filled pixel is averaged from, 1 to 64. Time grows with its
    /// square.
    pub radius: u32,
    /// How wide a void may be for [`FillMethod::Exemplar`], as a share of the picture's size: the square root of the
    /// number of valid pixels. Wider ones stay transparent, except where they get narrow. 0 to 100.
    pub max_width: f64,
}

impl Default for FillOptions {
    fn default() -> Self {
        Self { method: FillMethod::Exemplar, radius: 5, max_width: 0.2 }
    }
}

/// Fills the pixels of `voids` and makes them opaque; all others stay as they are.
///
/// Exemplar-based filling copies patches from around each void, coarse to fine (see [`FillMethod::Exemplar`]). With a `guide`
/// it uses only what is as far away as the background there: a void is background that something in front hides from both
/// cameras.
///
/// What `image` holds in a void is ignored, even if it is opaque. Void pixels that no path through the void joins to a
/// valid pixel (alpha not 0) cannot be filled, and those of too wide a void are not: they stay as they are. On an
/// error `image` is untouched, unless the observer cancels when all is done.
///
/// # Errors
/// `invalid-argument` for an option out of range, `size-mismatch` when mask or guide are not of the picture's size,
/// `out-of-memory`, `aborted`.
pub fn fill(
    image: &mut Image,
    voids: &Mask,
    guide: Option<&FillGuide>,
    options: &FillOptions,
    observer: &mut dyn Observer,
) -> Result<()> {
    check(image, voids, guide, options)?;
    report(observer, Stage::Fill, 0.0)?;
    let row = |y: usize| extent(voids.data()[y * voids.width()..(y + 1) * voids.width()].iter().map(|&void| void != 0));
    let Some(bounds) = bounding_box(voids.height(), &row) else { return report(observer, Stage::Fill, 1.0) };
    let mut parts = Parts::of(image, voids, bounds, options)?;
    let (clusters, alone) = Clusters::of(&parts)?;
    let mut filled = Vec::new();
    let share = EXEMPLARS / alone.len() as f32;
    for (i, cluster) in alone.iter().enumerate() {
        let done = i as f32 * share;
        let portion = &mut Portion::new(observer, done, done + share);
        let inside = |x, y| clusters.find(&parts, cluster, x, y).is_some();
        if !exemplar::fill(image, voids, &inside, cluster, guide, &mut filled, portion)? {
            // There is no piece that could be copied.
            let (columns, rows) = cluster.bounds.grown(0, image.size()).ranges();
            for y in rows {
                for x in columns.clone() {
                    if let Some(at) = clusters.find(&parts, cluster, x, y) {
                        parts.parts[at] = Part::Gap;
                    }
                }
            }
        }
    }
    let portion = &mut Portion::new(observer, if alone.is_empty() { 0.0 } else { EXEMPLARS }, 1.0);
    smooth::fill(image, &parts.gaps(image.width())?, voids, bounds, options.radius as usize, portion)?;
    let pixels = image.pixels_mut();
    filled.into_iter().for_each(|(at, colour)| pixels[at] = colour);
    report(observer, Stage::Fill, 1.0)
}

/// How much of the work the exemplars are, where there are any.
const EXEMPLARS: f32 = 0.9;

fn check(image: &Image, voids: &Mask, guide: Option<&FillGuide>, options: &FillOptions) -> Result<()> {
    check_size("voids", voids.size(), image.size())?;
    if let Some(FillGuide { depth, .. }) = guide {
        check_size("guide", depth.size(), image.size())?;
    }
    options.check()
}

impl FillOptions {
    /// Refuses what is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        if !(1..=64).contains(&self.radius) {
            let value = f64::from(self.radius);
            let expected = "between 1 and 64 pixels";
            return Err(Error::InvalidArgument { name: "fillRadius", expected, value }.into());
        }
        if !(0.0..=100.0).contains(&self.max_width) {
            let value = self.max_width;
            return Err(Error::InvalidArgument { name: "fillMaxWidth", expected: "from 0 to 100", value }.into());
        }
        Ok(())
    }
}
