//! Dense inverse depth: from matches, from stereo, extrapolated, and carried from one photo to the other.

mod completion;
mod correction;
mod diagonals;
pub(crate) mod holes;
mod interpolation;
mod pull_push;
mod stereo;
mod surface;
mod transfer;
mod two_view;

pub(crate) use completion::KnownDepth;
pub use completion::{CompletionOptions, complete_depth};
pub(crate) use correction::{MeasuredDepth, correct_outside};
pub use holes::Holes;
pub(crate) use stereo::{Prior, refine_prior};
pub use stereo::{RefineOptions, Refined, refine};
pub use surface::{Extrapolation, SurfaceShape};
pub(crate) use surface::{OtherView, PhotoLines, Surface, sample_grid, sample_step, sample_weight};
pub use transfer::{derive_depth, derive_missing};
pub(crate) use two_view::{SECOND_MAP, dense, reference_map, target_map};
pub use two_view::{TwoView, two_view};
