//! What files say about a photo besides its pixels.

use image::{ImageDecoder, ImageEncoder};

use super::exif::adapted;
use crate::Result;

/// Longest EXIF data that a JPEG can state, in bytes: a segment less its length and the name of the data.
const MOST_EXIF: usize = 65_535 - 2 - 6;

/// Colour profile and camera data of a photo.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Metadata {
    /// An ICC profile of RGB colours; without one they are sRGB.
    pub colour_profile: Option<Vec<u8>>,
    /// EXIF data: a TIFF file without an image.
    pub exif: Option<Vec<u8>>,
}

/// Of a PNG or JPEG file. Profiles that are not of RGB colours are left out, as the decoder makes RGB of all.
///
/// # Errors
/// `decode-failed` for another format or a damaged file, `too-large` above `max_pixels`.
pub fn read_metadata(bytes: &[u8], max_pixels: u64) -> Result<Metadata> {
    let mut decoder = super::decoder(bytes, max_pixels, 4)?;
    // What cannot be read of it is as good as nothing: the picture is there.
    let profile = decoder.icc_profile().ok().flatten();
    Ok(Metadata { colour_profile: profile.filter(|icc| is_rgb(icc)), exif: decoder.exif_metadata().ok().flatten() })
}

/// Whether these bytes are the beginning of an ICC profile of RGB colours (ICC.1:2022, section 7.2).
fn is_rgb(icc: &[u8]) -> bool {
    icc.get(16..20) == Some(b"RGB ") && icc.get(36..40) == Some(b"acsp")
}

/// Has them written in front of a picture of this size: EXIF data as of an upright picture without a thumbnail, and no damaged one.
pub(super) fn attach(encoder: &mut dyn Attach, metadata: &Metadata, size: (u32, u32)) {
    if let Some(profile) = &metadata.colour_profile {
        encoder.colour_profile(profile.clone());
    }
    let exif = metadata.exif.as_ref().and_then(|exif| adapted(exif, size));
    if let Some(exif) = exif.filter(|exif| exif.len() <= MOST_EXIF) {
        encoder.exif(exif);
    }
}

/// An encoder, whichever it is.
pub(super) trait Attach {
    fn colour_profile(&mut self, profile: Vec<u8>);
    fn exif(&mut self, exif: Vec<u8>);
}

impl<E: ImageEncoder> Attach for E {
    fn colour_profile(&mut self, profile: Vec<u8>) {
        // Both formats have a place for it.
        let _ = self.set_icc_profile(profile);
    }
    fn exif(&mut self, exif: Vec<u8>) {
        let _ = self.set_exif_metadata(exif);
    }
}
