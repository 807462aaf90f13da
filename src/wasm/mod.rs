//! The only place that knows wasm-bindgen: checks and converts, computes nothing.
//!
//! | file | what it holds | in TypeScript |
//! |---|---|---|
//! | `stages.rs` | the exported functions | `js/index.ts`, by way of `js/core.ts` |
//! | `many.rs` | the one for any number of photos, in a module that pages load when they need it | the same |
//! | `many_tasks.rs` | its tasks that another worker may perform | the same |
//! | `codecs.rs` | the codecs' module: PNG and JPEG | `js/codecs.ts` |
//! | `evaluation.rs` | the evaluation's module: what a person sees of a mosaic | `js/eval/appearance.ts` |
//! | `signatures.rs` | names of the types in their declarations | `types.d.ts` |
//! | `photos.rs`, `inputs.rs`, `matches.rs` | arguments, checked against the sizes that go with them | `js/check.ts` |
//! | `options.rs`, `specs.rs` | options; their ranges are generated | `js/options.ts` |
//! | `results.rs` | what goes back | `types.d.ts` |
//! | `running.rs`, `workers.rs` | calls that leave tasks to other workers | `js/core.ts` |
//! | `observer.rs`, `convert.rs` | progress and cancelling; fields of objects | |

mod convert;

#[cfg(feature = "wasm-codecs")]
mod codecs;

#[cfg(feature = "wasm-evaluation")]
mod evaluation;

#[cfg(any(feature = "wasm-core", feature = "wasm-evaluation"))]
mod inputs;
#[cfg(feature = "wasm-many")]
mod many;
#[cfg(feature = "wasm-many")]
mod many_tasks;
#[cfg(feature = "wasm-core")]
mod matches;
#[cfg(feature = "wasm-core")]
mod observer;
#[cfg(feature = "wasm-core")]
mod options;
#[cfg(feature = "wasm-core")]
mod photos;
#[cfg(feature = "wasm-core")]
mod results;
#[cfg(feature = "wasm-core")]
mod running;
#[cfg(feature = "wasm-core")]
mod signatures;
#[cfg(feature = "wasm-core")]
mod specs;
#[cfg(feature = "wasm-core")]
mod stages;
#[cfg(feature = "wasm-core")]
mod workers;

/// Smaller than the standard library's allocator and as sparing with memory. A test of the library links the library, with its own.
#[cfg(not(test))]
#[global_allocator]
static ALLOCATOR: talc::wasm::WasmDynamicTalc = talc::wasm::new_wasm_dynamic_allocator();

/// The public types, part of the declarations of every module.
#[wasm_bindgen::prelude::wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("types.d.ts");

#[wasm_bindgen::prelude::wasm_bindgen(start)]
fn start() {
    console_error_panic_hook::set_once();
}
