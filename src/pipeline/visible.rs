//! What is there of two photos.

use crate::geometry::Match;
use crate::image::reserve;
use crate::transparency::Extended;
use crate::{ImageView, Result, View};

/// Two photos whose masked pixels have been replaced, and the matches given for them.
pub(super) struct VisiblePair {
    /// Target and reference; `None` where none of it is masked.
    photos: [Option<Extended>; 2],
    /// `None` where those given are good.
    matches: Option<Vec<Match>>,
}

impl VisiblePair {
    pub fn of(given: Option<&[Match]>, [target, reference]: [View<'_>; 2]) -> Result<Self> {
        let photos = [Extended::of(target, "target")?, Extended::of(reference, "reference")?];
        if photos.iter().all(Option::is_none) {
            return Ok(Self { photos, matches: None });
        }
        let visible = |given: &[Match]| -> Result<Vec<Match>> {
            let mut matches = Vec::new();
            reserve(&mut matches, given.len())?;
            let shown = |m: &Match| shows(target.image, m.target) && shows(reference.image, m.reference);
            // What is not finite is no match, but keeps its place among the others.
            let nowhere = Match { target: [f64::NAN; 2], reference: [f64::NAN; 2] };
            matches.extend(given.iter().map(|m| if shown(m) { *m } else { nowhere }));
            Ok(matches)
        };
        Ok(Self { photos, matches: given.map(visible).transpose()? })
    }

    /// Whether nothing has been replaced.
    pub fn is_everything(&self) -> bool {
        self.photos.iter().all(Option::is_none)
    }

    /// Of those `given`.
    pub fn matches<'a>(&'a self, given: Option<&'a [Match]>) -> Option<&'a [Match]> {
        self.matches.as_deref().or(given)
    }

    /// Of those `given`.
    pub fn views<'a>(&'a self, [target, reference]: [View<'a>; 2]) -> [View<'a>; 2] {
        let [first, second] = &self.photos;
        [Extended::view(first, target), Extended::view(second, reference)]
    }
}

/// Whether a photo is not masked at the pixel nearest to a place, or the place is outside of it.
fn shows(photo: ImageView<'_>, [x, y]: [f64; 2]) -> bool {
    let [x, y] = [x, y].map(|v| (v + 0.5).floor());
    let inside = x >= 0.0 && y >= 0.0 && x < photo.width() as f64 && y < photo.height() as f64;
    !inside || photo.is_there(photo.pixel(x as usize, y as usize))
}
