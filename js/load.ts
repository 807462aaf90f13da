import { compile } from "./platform/index.js";
import { StitchError } from "./errors.js";
import type { WasmSource } from "./types.js";

/** Compiles a wasm file. The first successful call determines the source; later calls return the same module. */
export type Compile = (source?: WasmSource) => Promise<WebAssembly.Module>;

/** Compiles the wasm file at `url`, unless another source is given. */
export function compiler(url: URL): Compile {
  let module: Promise<WebAssembly.Module> | undefined;
  return (source = url) => {
    module ??= compile(source).catch((cause: unknown) => {
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
