//! Where aligned photos belong, in pixels of photos of another size.

use std::borrow::Cow;

use super::align::ManyAlignment;
use super::picture::ManyPicture;
use super::reduced::resampled;
use super::result::{Photo, PhotoMap};
use super::undistorted::UndistortedPhoto;
use crate::geometry::{MultiView, Undistortion};
use crate::pipeline::picture::Size;
use crate::{Error, InverseDepth, Result};

/// The geometry of the photos and the picture of them, at some size.
#[derive(Debug, Clone)]
pub(super) struct Placement {
    /// How many times as large the photos are as those that were aligned.
    pub factor: f64,
    /// Their sizes, without distortion.
    pub sizes: Vec<Size>,
    pub geometry: MultiView,
    pub picture: ManyPicture,
}

impl Placement {
    /// Of photos of these sizes, `factor` times as large as those that were aligned.
    ///
    /// # Errors
    /// `no-overlap` where the reference does not appear in the picture.
    pub fn of(alignment: &ManyAlignment, photos: &[Size], factor: f64) -> Result<Self> {
        let ManyAlignment { geometry, picture, sizes, .. } = alignment;
        if factor == 1.0 {
            return Ok(Self { factor, sizes: sizes.clone(), geometry: geometry.clone(), picture: picture.clone() });
        }
        let frame = |&size: &Size| alignment.distortion.map_or(size, |known| Undistortion::of(size, known).frame);
        let frames: Vec<Size> = photos.iter().map(frame).collect();
        let geometry = geometry.clone().resized(&frames, factor);
        let picture = picture.resized(factor, [sizes, &frames]).ok_or(Error::NoOverlap { pixels: 0 })?;
        Ok(Self { factor, sizes: frames, geometry, picture })
    }

    /// About how large the canvas becomes with these photos; `None` where that is not clear.
    pub fn canvas(&self, photos: &[usize], canvas_limit: f64) -> Option<Size> {
        let (mut least, mut most) = ([f64::INFINITY; 2], [-f64::INFINITY; 2]);
        for &photo in photos {
            let bounds = self.picture.bounds(photo, &self.sizes, &self.geometry)?.map(|v| v as f64);
            let limits = self.picture.limits(photo, &self.sizes, &self.geometry, canvas_limit);
            for k in 0..2 {
                let (min, max) =
                    limits.map_or((-f64::INFINITY, f64::INFINITY), |limits| (limits.min[k], limits.max[k]));
                (least[k], most[k]) = (least[k].min(bounds[k].max(min)), most[k].max(bounds[2 + k].min(max)));
            }
        }
        let [width, height] = [0, 1].map(|k| (most[k] - least[k] + 1.0) as usize);
        Some((width, height))
    }

    /// The depth of an aligned photo, at the size that it has here.
    ///
    /// # Errors
    /// `out-of-memory`.
    pub fn depth<'a>(&self, map: Cow<'a, InverseDepth>, photo: usize) -> Result<Cow<'a, InverseDepth>> {
        if self.factor == 1.0 {
            return Ok(map);
        }
        Ok(Cow::Owned(resampled(&map, self.sizes[photo], self.factor)?))
    }

    /// Where the pixels of a photo belong, with its depth, which is taken from the alignment; `given` is the photo with the distortion of its lens.
    ///
    /// # Errors
    /// `out-of-memory`.
    pub fn take_map(&self, alignment: &mut ManyAlignment, photo: usize, given: &Photo<'_>) -> Result<Option<PhotoMap>> {
        let pairs = [[photo, alignment.reference], [alignment.reference, photo]];
        let [Some(forward), Some(reverse)] = pairs.map(|pair| self.geometry.model(pair)) else { return Ok(None) };
        let depth = alignment.depths[photo].take();
        let depth = depth.map(|depth| self.depth(Cow::Owned(depth.map), photo)).transpose()?.map(Cow::into_owned);
        let undistorted = |distortion| UndistortedPhoto::of(&Photo { depth: None, ..*given }, distortion);
        let undistorted = alignment.distortion.map(undistorted).transpose()?.map(UndistortedPhoto::into_image);
        Ok(Some(PhotoMap { forward, reverse, depth, undistorted }))
    }
}
