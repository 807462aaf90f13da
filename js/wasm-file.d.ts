import type { WasmSource } from "./types.js";

/**
 * What an import of one of the package's `.wasm` files gives is up to the bundler and its settings: an address or the bytes.
 * `init` takes either.
 */
declare const source: WasmSource;
export default source;
