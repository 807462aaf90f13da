//! Putting photos together: exposure, seam, blending, filling. Two at once by [`blend`]; of many, one after another is added to
//! a [`Composition`].
//!
//! The paper (section 3.2.4) averages, which shows how well the photos are aligned: [`BlendOptions::paper`]. By default the
//! target's exposure is matched to the reference's, a minimum cut decides which photo shows where, and the bands of
//! a Laplacian pyramid are blended across it.

mod alignment;
mod average;
mod blend;
mod canvas;
mod composition;
pub mod crop;
mod exposure;
mod feather;
mod fill;
mod guide;
mod multiband;
mod seam;

pub(crate) use alignment::{EDGE_NODES, node_side};
pub use blend::{BlendOptions, Blending, Exposure, Mosaic, Seam, SeamGuide, blend};
pub use composition::{Added, Composition, Layer};
pub(crate) use exposure::{check_gains, gain_table, lift_shadows};
pub use fill::{FillMethod, FillOptions, fill};
pub use guide::FillGuide;
pub(crate) use seam::{Choice, predict as predict_seam};
