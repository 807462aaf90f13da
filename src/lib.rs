//! Stitches two photos of one scene taken from two places, using depth.
//!
//! An implementation of T. Liao and N. Li, *Natural Image Stitching using Depth Maps*. The target photo is warped
//! onto the reference by `x' ~ H∞ x̃ + e'·d(x)`, where `d` is an inverse-depth map of the target; see [`pipeline`]
//! for the whole way and the other modules for its stages, each of which can be called alone.
//!
//! Conventions: pixel centres are integers, origin top left, x right, y down; `target` moves, `reference` stays;
//! depth is always inverse depth (larger is nearer), known only up to an affine change.

#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[cfg(feature = "codecs")]
pub mod codecs;
mod decimal;
pub mod depth;
mod distance;
pub mod error;
pub mod features;
pub mod geometry;
pub mod image;
mod lanes;
pub mod metrics;
pub mod mosaic;
pub mod observer;
pub mod pipeline;
mod rect;
pub mod report;
mod rows;
mod sampler;
mod sort;
mod statistics;
pub mod warp;

#[cfg(target_arch = "wasm32")]
mod wasm;

/// Smaller than the standard library's, and as sparing with memory.
#[cfg(target_arch = "wasm32")]
#[global_allocator]
static ALLOCATOR: talc::wasm::WasmDynamicTalc = talc::wasm::new_wasm_dynamic_allocator();

pub use error::{Error, Result, Stage};
pub use image::{Image, ImageView, InverseDepth, Mask, View};
pub use rect::Rect;
