//! The only place that knows wasm-bindgen: checks and converts, computes nothing.

mod convert;

#[cfg(feature = "codecs")]
mod codecs;
