//! A pair as the stages take it: rendered here, or read from files by `cases`.

use depthstitch::geometry::Match;
use depthstitch::inverse_depth::DepthKind;
use depthstitch::{Image, InverseDepth};

use super::pair::{MatchOptions, Pair};
use super::render::View;

/// Photos, their depth if there is any, and matches.
#[derive(Debug, Clone)]
pub struct Photos {
    pub target: Image,
    pub reference: Image,
    pub target_depth: Option<InverseDepth>,
    pub reference_depth: Option<InverseDepth>,
    pub matches: Vec<Match>,
}

impl Photos {
    /// Both views with their true depth.
    pub fn of(pair: &Pair<'_>, matches: &MatchOptions) -> Self {
        Self {
            target: photo(&pair.target),
            reference: photo(&pair.reference),
            target_depth: Some(inverse_depth(&pair.target)),
            reference_depth: Some(inverse_depth(&pair.reference)),
            matches: pair.matches(matches).matches,
        }
    }

    pub fn target(&self) -> depthstitch::View<'_> {
        depthstitch::View { image: self.target.view(), depth: self.target_depth.as_ref() }
    }

    pub fn reference(&self) -> depthstitch::View<'_> {
        depthstitch::View { image: self.reference.view(), depth: self.reference_depth.as_ref() }
    }
}

fn photo(view: &View) -> Image {
    Image::new(view.rgba.clone(), view.width, view.height).unwrap()
}

fn inverse_depth(view: &View) -> InverseDepth {
    let size = (view.width, view.height);
    InverseDepth::new("depth", &view.inverse_depth(), size, DepthKind::Inverse, None, size)
        .unwrap_or_else(|error| panic!("a rendered depth map is none: {error}"))
}
