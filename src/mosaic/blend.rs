//! From the warped target and the reference to the mosaic.

use super::average::{average, opaque_or_empty};
use super::canvas::Placed;
use super::{alignment, exposure, feather, multiband, seam};
use crate::geometry::Match;
use crate::image::{check_size, reserve};
use crate::observer::{Observer, Portion, report};
use crate::transparency::outside;
use crate::warp::Warped;
use crate::{Error, Image, ImageView, Mask, Result, Stage};

/// How the target's exposure is matched to the reference's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exposure {
    /// Not at all.
    Off,
    /// One gain per channel, in linear light.
    Gain,
    /// A gain per channel that varies smoothly over the canvas, fades to the common one outside the overlap, and may be a
    /// little more for the bright than for the dark.
    #[default]
    Field,
}

/// What decides which photo shows where both are valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seam {
    /// The photo whose own border is farther away.
    Off,
    /// A minimum cut through where the photos agree.
    Cut,
    /// The same, and then the target gives way around it, so that what crosses it is not broken.
    #[default]
    Aligned,
}

/// How the photos pass into each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Blending {
    /// The average where both are valid (the paper). No seam plays a part.
    Average,
    /// A ramp across the seam.
    Feather,
    /// Burt and Adelson's: each band of frequencies across as many pixels as it needs.
    #[default]
    Multiband,
}

/// Options of [`blend`].
#[derive(Debug, Clone, PartialEq)]
pub struct BlendOptions {
    /// How the target's exposure is matched to the reference's.
    pub exposure: Exposure,
    /// What decides which photo shows where both are valid.
    pub seam: Seam,
    /// How the photos pass into each other.
    pub blending: Blending,
    /// Pixels from one end of a feathered ramp to the other, 0 (a hard edge) to 1000.
    pub feather: u32,
    /// Bands of the multiband pyramid, 1 to 10; 0 for as many as the photos' size asks for: the widest transition is
    /// then about a third of the reference's longer side.
    pub bands: u32,
}

impl Default for BlendOptions {
    fn default() -> Self {
        Self {
            exposure: Exposure::default(),
            seam: Seam::default(),
            blending: Blending::default(),
            feather: 32,
            bands: 0,
        }
    }
}

impl BlendOptions {
    /// The plain average of the paper, section 3.2.4.
    pub fn paper() -> Self {
        Self { exposure: Exposure::Off, seam: Seam::Off, blending: Blending::Average, ..Self::default() }
    }

    /// Refuses numbers out of their ranges.
    ///
    /// # Errors
    /// `invalid-argument`.
    pub(crate) fn check(&self) -> Result<()> {
        for (name, value, most, expected) in [
            ("feather", self.feather, 1000, "between 0 and 1000 pixels"),
            ("bands", self.bands, 10, "between 0 and 10"),
        ] {
            if value > most {
                return Err(Error::InvalidArgument { name, expected, value: f64::from(value) }.into());
            }
        }
        Ok(())
    }
}

/// The two photos on one canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Mosaic {
    /// RGBA, alpha 255 where either photo is valid, 0 (and black) elsewhere.
    pub image: Image,
    /// Pixels inside the warped target's footprint, or in holes of the reference, that neither photo covers.
    pub voids: Mask,
    /// Which photo shows: 0 none, 1 the target, 2 the reference, 3 both averaged.
    pub seam: Mask,
    /// What the target's red, green and blue were multiplied by in linear light, on average over the overlap.
    pub gains: [f64; 3],
}

/// What decides which photo shows where both are valid, besides how alike they are.
#[derive(Debug, Clone, Copy, Default)]
pub struct SeamGuide<'a> {
    /// On the reference's grid, where the alignment is reliable: the seam keeps away from elsewhere.
    pub reliable: Option<&'a Mask>,
    /// Where the warped target and the reference show the same, in pixels of the canvas: what they show at different places, as it moved or is
    /// not aligned, is to be seen once.
    pub matches: &'a [Match],
}

/// Composes the mosaic of the warped target and the reference. The reference's colours are changed only across the seam.
///
/// The target is valid where the warped alpha is not 0, the reference where it is not masked: a hole in it is a void unless the target shows
/// there, and where it ends within its frame is none.
///
/// # Errors
/// `size-mismatch` when the reference does not fit the canvas or a mask has another size, `invalid-argument` for options
/// out of range, `out-of-memory`, `aborted`.
pub fn blend(
    warped: &Warped,
    reference: ImageView<'_>,
    guide: &SeamGuide<'_>,
    options: &BlendOptions,
    observer: &mut dyn Observer,
) -> Result<Mosaic> {
    check(warped, reference, guide, options)?;
    report(observer, Stage::Blend, 0.0)?;

    // The target on the canvas, and which photos are valid where.
    let (canvas, width, height) = (warped.image.data(), warped.image.width(), warped.image.height());
    let placed = Placed { photo: reference, left: warped.offset.0, top: warped.offset.1 };
    let mut data = Vec::new();
    reserve(&mut data, canvas.len())?;
    data.extend_from_slice(canvas);
    data.as_chunks_mut().0.iter_mut().for_each(|pixel| *pixel = opaque_or_empty(*pixel));
    let mut image = Image::from_bytes(data, width, height);
    let mut seam = seam::sides(&image, &placed)?;

    // Colours, then the seam, then the transition across it.
    let preference = seam::Preference { guide: *guide, confidence: warped.confidence.as_ref(), labels: None };
    let gains = compose((&mut image, None), &mut seam, &placed, &preference, options, observer)?;

    // Voids: within the footprint, but of neither photo.
    let mut voids = Vec::new();
    reserve(&mut voids, width * height)?;
    let drawn = warped.footprint.data().iter().zip(seam.data());
    voids.extend(drawn.map(|(&drawn, &shown)| if drawn != 0 && shown == seam::NONE { 255 } else { 0 }));
    let mut voids = Mask::from_bytes(voids, width, height);
    add_holes(&mut voids, &placed, &seam)?;
    report(observer, Stage::Blend, 1.0)?;
    Ok(Mosaic { image, voids, seam, gains })
}

/// Adds what the reference has holes in, and neither photo shows.
fn add_holes(voids: &mut Mask, reference: &Placed<'_>, seam: &Mask) -> Result<()> {
    let (photo, canvas) = (reference.photo, seam.width());
    let Some(outside) = outside(photo)? else { return Ok(()) };
    for (at, &pixel) in photo.pixels().iter().enumerate() {
        let (x, y) = (reference.left + at % photo.width(), reference.top + at / photo.width());
        let place = y * canvas + x;
        if !photo.is_there(pixel) && outside.data()[at] == 0 && seam.data()[place] == seam::NONE {
            voids.data_mut()[place] = 255;
        }
    }
    Ok(())
}

/// Puts a photo onto what is there: matches its exposure, decides which shows where both are valid, which `seam` says before,
/// and blends across that. Returns the gains; those that are given are only refined locally.
pub(super) fn compose(
    (image, gains): (&mut Image, Option<[f64; 3]>),
    seam: &mut Mask,
    base: &Placed<'_>,
    preference: &seam::Preference<'_>,
    options: &BlendOptions,
    observer: &mut dyn Observer,
) -> Result<[f64; 3]> {
    let gains = exposure::adjust(image, base, options.exposure, gains, &mut Portion::new(observer, 0.0, 0.25))?;
    if options.blending == Blending::Average {
        average(image, base);
        return Ok(gains);
    }
    if options.seam == Seam::Off {
        seam::middle(image, base, seam)?;
    } else {
        seam::cut(image, base, preference, seam, &mut Portion::new(observer, 0.25, 0.55))?;
    }
    if options.seam == Seam::Aligned {
        alignment::align(image, base, seam, &mut Portion::new(observer, 0.55, 0.6))?;
    }
    let observer = &mut Portion::new(observer, 0.6, 1.0);
    match options.blending {
        Blending::Feather => feather::blend(image, base, seam, options.feather, observer)?,
        _ => multiband::blend(image, base, seam, options.bands, observer)?,
    }
    Ok(gains)
}

fn check(warped: &Warped, reference: ImageView<'_>, guide: &SeamGuide<'_>, options: &BlendOptions) -> Result<()> {
    warped.check_canvas(reference)?;
    if let Some(reliable) = guide.reliable {
        check_size("reliable", reliable.size(), reference.size())?;
    }
    options.check()
}
