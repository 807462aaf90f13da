//! Photos without the distortion of their lens, which all that follows is made of.

use super::memory::Budget;
use super::result::Photo;
use crate::features::Features;
use crate::geometry::{Distortion, PairLink, Undistortion};
use crate::image::reserve;
use crate::transparency::Extended;
use crate::warp::bilinear;
use crate::{Image, ImageView, InverseDepth, Result, View};

/// Every photo in a frame that holds all of it.
#[derive(Debug, Clone)]
pub(super) struct UndistortedPhotos {
    pub distortion: Distortion,
    photos: Vec<UndistortedPhoto>,
}

/// A photo in its frame.
#[derive(Debug, Clone)]
pub(super) struct UndistortedPhoto {
    lens: Undistortion,
    /// What it does not fill of its frame is masked.
    photo: Extended,
}

impl UndistortedPhoto {
    /// # Errors
    /// `out-of-memory`.
    pub fn of(photo: &Photo<'_>, distortion: Distortion) -> Result<Self> {
        let lens = Undistortion::of(photo.image.size(), distortion);
        let depth = photo.depth.map(|depth| undistorted_depth(depth, &lens)).transpose()?;
        Ok(Self { lens, photo: Extended::new(undistorted_image(photo.image, &lens)?, depth)? })
    }

    /// The photo.
    pub fn image(&self) -> ImageView<'_> {
        self.photo.as_view().image
    }

    /// The photo.
    pub fn into_image(self) -> Image {
        self.photo.into_image()
    }
}

impl UndistortedPhotos {
    /// Moves the `features` to where they are in the frames.
    ///
    /// # Errors
    /// `too-large` where the `budget` does not suffice, `out-of-memory`.
    pub fn of(
        photos: &[Photo<'_>],
        features: &mut [Features],
        distortion: Distortion,
        budget: &mut Budget<'_>,
    ) -> Result<Self> {
        let lenses = photos.iter().map(|photo| Undistortion::of(photo.image.size(), distortion));
        budget.undistort(&lenses.clone().map(|lens| lens.frame).collect::<Vec<_>>())?;
        let photos: Vec<UndistortedPhoto> =
            photos.iter().map(|photo| UndistortedPhoto::of(photo, distortion)).collect::<Result<_>>()?;
        photos.iter().zip(features).for_each(|(photo, features)| move_features(&photo.lens, features));
        Ok(Self { distortion, photos })
    }

    /// The photos without distortion, or those `given` where there is none.
    pub fn shown<'a>(undistorted: &'a Option<Self>, given: &[Photo<'a>]) -> Vec<Photo<'a>> {
        let Some(undistorted) = undistorted else { return given.to_vec() };
        let one = |(own, photo): (&'a UndistortedPhoto, &Photo<'a>)| {
            let View { image, depth } = own.photo.as_view();
            Photo { image, depth, ..*photo }
        };
        undistorted.photos.iter().zip(given).map(one).collect()
    }

    /// Width and height of each frame.
    pub fn frames(&self) -> Vec<(usize, usize)> {
        self.photos.iter().map(|photo| photo.lens.frame).collect()
    }

    /// The photos in their frames.
    pub fn photos(&self) -> &[UndistortedPhoto] {
        &self.photos
    }

    /// Moves matches to where they are in the frames.
    pub fn move_matches(&self, links: &mut [PairLink]) {
        for link in links {
            let [a, b] = link.photos.map(|photo| &self.photos[photo].lens);
            for m in &mut link.matches {
                (m.target, m.reference) = (a.undistort(m.target), b.undistort(m.reference));
            }
        }
    }
}

/// Depth, and colours for comparison, go on so far beyond a photo's border, in pixels: rendering cuts it off where it ends.
const MARGIN: f64 = 2.0;

/// Where a pixel of the frame is in the photo; `None` outside of it.
fn place(lens: &Undistortion, x: usize, y: usize) -> Option<[f64; 2]> {
    let [x, y] = lens.distort([x as f64, y as f64]);
    let last = |side: usize| side as f64 - 1.0;
    let (right, bottom) = (last(lens.photo.0), last(lens.photo.1));
    let within = x > -MARGIN && y > -MARGIN && x < right + MARGIN && y < bottom + MARGIN;
    within.then(|| [x.max(0.0).min(right), y.max(0.0).min(bottom)])
}

/// Moves the features of a photo to where they are in its frame.
fn move_features(lens: &Undistortion, features: &mut Features) {
    features.size = lens.frame;
    for keypoint in &mut features.keypoints {
        [keypoint.x, keypoint.y] = lens.undistort([keypoint.x, keypoint.y].map(f64::from)).map(|p| p as f32);
    }
}

/// The photo in its frame.
fn undistorted_image(photo: ImageView<'_>, lens: &Undistortion) -> Result<Image> {
    let (width, height) = lens.frame;
    let mut image = Image::transparent(width, height)?;
    for (i, out) in image.pixels_mut().iter_mut().enumerate() {
        let Some(place) = place(lens, i % width, i / width) else { continue };
        let [x, y] = place.map(|p| (p + 0.5) as usize);
        if photo.is_there(photo.pixel(x, y)) {
            *out = bilinear(&photo, place);
        }
    }
    Ok(image)
}

/// Depth in the frame; not known outside of the photo.
fn undistorted_depth(depth: &InverseDepth, lens: &Undistortion) -> Result<InverseDepth> {
    let (width, height) = lens.frame;
    let at = |i: usize| place(lens, i % width, i / width).map_or(f32::NAN, |[x, y]| depth.sample(x, y) as f32);
    let mut values = Vec::new();
    reserve(&mut values, width * height)?;
    values.extend((0..width * height).map(at));
    Ok(InverseDepth::from_values(values, width, height))
}
