//! The only place that knows wasm-bindgen: checks and converts, computes nothing.

mod convert;

#[cfg(feature = "codecs")]
mod codecs;

#[cfg(feature = "core")]
mod inputs;
#[cfg(feature = "core")]
mod observer;
#[cfg(feature = "core")]
mod options;
#[cfg(feature = "core")]
mod photos;
#[cfg(feature = "core")]
mod results;
#[cfg(feature = "core")]
mod signatures;
#[cfg(feature = "core")]
mod specs;
#[cfg(feature = "core")]
mod stages;

/// The public types, part of the declarations of either module.
#[wasm_bindgen::prelude::wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("types.d.ts");
