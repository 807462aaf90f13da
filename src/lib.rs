//! Stitches two photos of one scene taken from two places, using depth.
//!
//! An implementation of T. Liao and N. Li, *Natural Image Stitching using Depth Maps*. Camera translation causes parallax,
//! which no single homography can compensate; so the target photo is warped onto the reference by
//! `x' ~ H∞ x̃ + e'·d(x)`, where `d` is an inverse-depth map of the target. [`pipeline::stitch`] does everything; the other
//! modules are its stages, each of which can be called alone. [`pipeline::many::stitch_many`] stitches up to thirty photos.
//!
//! Conventions: pixel centres are integers, origin top left, x right, y down; `target` is warped, `reference` stays;
//! depth is always inverse depth (larger is nearer), known up to an affine change.
//!
//! # Two photos
//!
//! Features are detected and matched, and depth comes from the photos themselves.
//!
//! ```
//! use depthstitch::pipeline::{Options, stitch};
//! use depthstitch::{Image, View};
//!
//! # fn noise(x: usize, y: usize) -> [u8; 4] {
//! #     let hash = |i: usize, j: usize| {
//! #         let h = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
//! #         ((h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 56) as f64
//! #     };
//! #     let (i, j, u, v) = (x / 7, y / 7, (x % 7) as f64 / 7.0, (y % 7) as f64 / 7.0);
//! #     let row = |j: usize| hash(i, j) * (1.0 - u) + hash(i + 1, j) * u;
//! #     let level = (row(j) * (1.0 - v) + row(j + 1) * v) as u8;
//! #     [level, level, level, 255]
//! # }
//! // Two photos of a wall with some texture, 200×150 pixels; the reference was taken 60 pixels further to the right.
//! let photo = |left: usize| {
//!     let pixels = (0..200 * 150).flat_map(|i| noise(left + i % 200, i / 200));
//!     Image::new(pixels.collect(), 200, 150)
//! };
//! let (target, reference) = (photo(0)?, photo(60)?);
//!
//! let target = View { image: target.view(), depth: None };
//! let reference = View { image: reference.view(), depth: None };
//! let stitched = stitch(None, target, reference, &Options::default(), &mut ())?;
//!
//! assert!(stitched.mosaic.image.width().abs_diff(260) <= 2);
//! assert!(stitched.quality.ssim_mask > 0.9);
//! # Ok::<(), Box<depthstitch::Error>>(())
//! ```
//!
//! # With depth maps and matches
//!
//! ```
//! use depthstitch::geometry::Match;
//! use depthstitch::inverse_depth::DepthKind;
//! use depthstitch::pipeline::{Options, stitch};
//! use depthstitch::{Image, InverseDepth, View};
//!
//! # fn noise(x: usize, y: usize) -> [u8; 4] {
//! #     let hash = |i: usize, j: usize| {
//! #         let h = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
//! #         ((h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 56) as f64
//! #     };
//! #     let (i, j, u, v) = (x / 7, y / 7, (x % 7) as f64 / 7.0, (y % 7) as f64 / 7.0);
//! #     let row = |j: usize| hash(i, j) * (1.0 - u) + hash(i + 1, j) * u;
//! #     let level = (row(j) * (1.0 - v) + row(j + 1) * v) as u8;
//! #     [level, level, level, 255]
//! # }
//! // A square board in front of a wall. The reference's camera is to the right of the target's: the wall moves 30 pixels
//! // to the left between the photos, the board, which is nearer, 42.
//! const SIZE: (usize, usize) = (160, 120);
//! let on_board = |x: usize, y: usize| (80..120).contains(&x) && (40..80).contains(&y);
//! let pixel = |i: usize, wall: usize, board: usize| {
//!     let (x, y) = (i % SIZE.0, i / SIZE.0);
//!     if on_board(x + board, y) { (noise(x + board + 500, y), 1.0) } else { (noise(x + wall, y), 0.25) }
//! };
//! let photo = |wall, board| {
//!     let (colours, depth): (Vec<_>, Vec<f32>) = (0..SIZE.0 * SIZE.1).map(|i| pixel(i, wall, board)).unzip();
//!     let depth = InverseDepth::new("depth", &depth, SIZE, DepthKind::Inverse, None, SIZE)?;
//!     Ok::<_, Box<depthstitch::Error>>((Image::new(colours.concat(), SIZE.0, SIZE.1)?, depth))
//! };
//! let ((target, target_depth), (reference, reference_depth)) = (photo(0, 0)?, photo(30, 42)?);
//! let matches: Vec<Match> = (0..300)
//!     .map(|i| (44 + i * 37 % 114, i * 53 % 118))
//!     .map(|(x, y)| (x, y, if on_board(x, y) { 42 } else { 30 }))
//!     .map(|(x, y, shift)| Match { target: [x as f64, y as f64], reference: [(x - shift) as f64, y as f64] })
//!     .collect();
//!
//! let target = View { image: target.view(), depth: Some(&target_depth) };
//! let reference = View { image: reference.view(), depth: Some(&reference_depth) };
//! let stitched = stitch(Some(&matches), target, reference, &Options::default(), &mut ())?;
//!
//! // Wall and board are both where they belong.
//! assert!(stitched.quality.psnr_mask > 25.0 && stitched.quality.coverage > 0.6);
//! # Ok::<(), Box<depthstitch::Error>>(())
//! ```

#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[cfg(feature = "codecs")]
pub mod codecs;
mod components;
mod decimal;
pub mod depth;
mod distance;
mod each_row;
pub mod error;
pub mod features;
pub mod geometry;
pub mod image;
pub mod inverse_depth;
mod lanes;
mod line_fit;
mod luma;
pub mod metrics;
pub mod mosaic;
pub mod observer;
pub mod pipeline;
mod rect;
pub mod report;
mod rows;
mod sampler;
mod sort;
mod srgb;
mod statistics;
mod transparency;
mod upsampling;
pub mod warp;
mod workers;

#[cfg(all(target_arch = "wasm32", feature = "wasm-module"))]
mod wasm;

pub use error::{Error, Result, Stage};
pub use image::{Image, ImageView, Mask};
pub use inverse_depth::{InverseDepth, View};
pub use rect::Rect;
