//! What is there of many photos.

use super::result::Photo;
use crate::transparency::Extended;
use crate::{Error, Result, View};

/// Photos whose masked pixels have been replaced; `None` where none is masked.
pub(super) struct VisiblePhotos(Vec<Option<Extended>>);

impl VisiblePhotos {
    pub fn of(photos: &[Photo<'_>]) -> Result<Self> {
        let extended =
            |(i, photo): (usize, &Photo<'_>)| Extended::of(photo.view(), "photo").map_err(Error::of_photo(i));
        photos.iter().enumerate().map(extended).collect::<Result<_>>().map(Self)
    }

    /// Of those `given`.
    pub fn photos<'a>(&'a self, given: &[Photo<'a>]) -> Vec<Photo<'a>> {
        let visible = |(extended, photo): (&'a Option<Extended>, &Photo<'a>)| {
            let View { image, depth } = Extended::view(extended, photo.view());
            Photo { image, depth, ..*photo }
        };
        self.0.iter().zip(given).map(visible).collect()
    }
}
