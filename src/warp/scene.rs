//! What is rendered, and what it is compared with.

use super::{Screen, WarpOptions};
use crate::geometry::Model;
use crate::{ImageView, InverseDepth};

/// Everything the choice between candidates looks at. Depth maps are there where the models have parallax.
pub(super) struct Scene<'a> {
    pub target: ImageView<'a>,
    pub target_depth: Option<&'a InverseDepth>,
    pub reference: ImageView<'a>,
    /// Whether the reference is there only where its alpha is not 0.
    pub masked: bool,
    pub reference_depth: Option<&'a InverseDepth>,
    /// From the reference's pixels, or the rays of its screen.
    pub reverse: &'a Model,
    pub screen: Option<Screen>,
    pub options: &'a WarpOptions,
}
