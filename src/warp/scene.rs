//! What is rendered, and what it is compared with.

use super::{Distorted, ProjectionSurface, WarpOptions};
use crate::geometry::Model;
use crate::{ImageView, InverseDepth, Mask};

/// Everything the choice between candidates looks at. Depth maps are there where the models have parallax.
pub(super) struct Scene<'a> {
    pub target: ImageView<'a>,
    pub distorted: Option<Distorted<'a>>,
    /// Where the target ends within its frame; `None` where none of it is masked.
    pub outside: Option<&'a Mask>,
    pub target_depth: Option<&'a InverseDepth>,
    pub reference: ImageView<'a>,
    pub reference_depth: Option<&'a InverseDepth>,
    /// From the reference's pixels, or the rays of its projection surface.
    pub reverse: &'a Model,
    pub surface: Option<ProjectionSurface>,
    pub options: &'a WarpOptions,
}
