//! What is rendered, and what it is compared with.

use super::WarpOptions;
use crate::geometry::Model;
use crate::{ImageView, InverseDepth};

/// Everything the choice between candidates looks at. Depth maps are there where the models have parallax.
pub(super) struct Scene<'a> {
    pub target: ImageView<'a>,
    pub target_depth: Option<&'a InverseDepth>,
    pub reference: ImageView<'a>,
    pub reference_depth: Option<&'a InverseDepth>,
    pub reverse: &'a Model,
    pub options: &'a WarpOptions,
}
