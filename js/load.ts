import { compile } from "#platform";
import { StitchError } from "./errors.js";
import type { WasmSource } from "./types.js";

/** Compiles a wasm file. The first call decides from where; later ones get the same module, unless it failed. */
export type Compile = (source?: WasmSource) => Promise<WebAssembly.Module>;

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

export function loadError(message: string, cause: unknown): StitchError {
  const reason = cause instanceof Error ? `: ${cause.message}` : "";
  return new StitchError(
    { code: "load-failed", stage: "load", message: message + reason, details: {} },
    { cause },
  );
}
