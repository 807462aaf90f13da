//! A small ray-caster: two views of one scene with exact depth and the true map between them.
//!
//! World axes: x right, y down (up is −y), z forward; unit metre. The floor is y = 0. Everything is deterministic to
//! the byte, natively and in wasm: no transcendental function but `libm`'s.
#![allow(clippy::unwrap_used)]

mod camera;
mod gallery;
mod light;
mod measure;
mod noise;
mod pair;
mod photos;
mod presets;
mod render;
mod sets;
mod shape;
mod texture;
mod views;

pub use camera::{Camera, Pose};
pub use gallery::gallery;
pub use light::{level, linear, take};
pub use measure::{distance, map_error, median, quantile};
pub use noise::Random;
pub use pair::{MatchOptions, Pair, SampledMatches};
pub use photos::Photos;
pub use presets::{court, plane, room, rotation, square, textureless, walk};
pub use render::{Scene, View};
pub use sets::{SIZE, camera, codes, depth_map, gallery_from, gallery_through, landing_errors, photos, with_cameras};
pub use views::Views;
