//! Dense inverse depth: from matches, from stereo, extrapolated, and carried from one photo to the other.

mod extrapolation;
pub(crate) mod holes;
mod interpolation;
mod pull_push;
mod stereo;
mod transfer;
mod two_view;

pub use extrapolation::continue_outside;
pub use holes::Holes;
pub(crate) use stereo::{Prior, refine_prior};
pub use stereo::{RefineOptions, Refined, refine};
pub use transfer::{derive_depth, derive_missing};
pub use two_view::{TwoView, two_view};
