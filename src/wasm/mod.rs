//! The only place that knows wasm-bindgen: checks and converts, computes nothing.

mod convert;

#[cfg(feature = "wasm-codecs")]
mod codecs;

#[cfg(feature = "wasm-core")]
mod inputs;
#[cfg(feature = "wasm-core")]
mod observer;
#[cfg(feature = "wasm-core")]
mod options;
#[cfg(feature = "wasm-core")]
mod photos;
#[cfg(feature = "wasm-core")]
mod results;
#[cfg(feature = "wasm-core")]
mod signatures;
#[cfg(feature = "wasm-core")]
mod specs;
#[cfg(feature = "wasm-core")]
mod stages;

/// Smaller than the standard library's allocator and as sparing with memory.
#[global_allocator]
static ALLOCATOR: talc::wasm::WasmDynamicTalc = talc::wasm::new_wasm_dynamic_allocator();

/// The public types, part of the declarations of either module.
#[wasm_bindgen::prelude::wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("types.d.ts");
