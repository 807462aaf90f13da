import { compile } from "./platform/index.js";
import { StitchError } from "./errors.js";
import type { WasmSource } from "./types.js";

/** Compiles a wasm file. The first successful call determines the source; later calls return the same module. */
export type Compile = (source?: WasmSource) => Promise<WebAssembly.Module>;

/**
 * Compiles the wasm file at the address that `locate` returns, unless another source is given. The address is not asked for
 * earlier, as it cannot be formed where a bundler leaves `import.meta.url` undefined.
 */
export function compiler(locate: () => URL): Compile {
  let module: Promise<WebAssembly.Module> | undefined;
  const load = async (source: WasmSource | undefined) => compile(source ?? locate());
  return (source) => {
    module ??= load(source).catch((cause: unknown) => {
      module = undefined;
      throw loadError("could not load the wasm module", cause);
    });
    return module;
  };
}

/** A `load-failed` error. */
export function loadError(message: string, cause: unknown): StitchError {
  const reason = cause instanceof Error ? `: ${cause.message}` : "";
  return new StitchError(
    { code: "load-failed", stage: "load", message: message + reason, details: {} },
    { cause },
  );
}
