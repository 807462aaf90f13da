// Checks of the arguments of networks. These never reach the core, so values are checked here as well.
import * as check from "../check.js";
import { tag, unexpected } from "../describe.js";
import { invalid, StitchError } from "../errors.js";
import type { Mask, Size } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, WasmPaths, Weights } from "./types.js";

export {
  boolean,
  count,
  object,
  positive,
  read,
  size,
  text,
  triple,
  wholeImage as image,
} from "../check.js";

/** A mask of the same size as an image. */
export function maskOf(name: string, value: Mask, size: Size): Mask {
  const mask = check.sized(name, check.mask(name, value), 1);
  if (mask.width !== size.width || mask.height !== size.height) {
    const details = {
      width: mask.width,
      height: mask.height,
      expectedWidth: size.width,
      expectedHeight: size.height,
    };
    const message = `${name} is ${mask.width}×${mask.height}, the image ${size.width}×${size.height}`;
    throw new StitchError({ code: "size-mismatch", stage: "input", message, details });
  }
  return mask;
}

/** One of `choices`. */
export function oneOf<T extends string>(name: string, value: unknown, ...choices: T[]): T {
  const chosen = choices.find((choice) => choice === value);
  if (chosen !== undefined) return chosen;
  const words = choices.map((choice) => `"${choice}"`).join(" or ");
  throw unexpected(`${name} must be ${words}`, value);
}

/** Rejects unknown options, as misspelled ones would be ignored. */
export function known(options: unknown, names: readonly string[]): void {
  for (const name of Object.keys(check.object("options", options))) {
    if (!names.includes(name)) throw invalid(`there is no option ${name}`);
  }
}

export function weights(name: string, value: Weights): string | URL | Uint8Array {
  return isAddress(value) ? value : check.bytes(name, value);
}

/** Where a file or a folder is. */
export function address(name: string, value: unknown): string | URL {
  if (isAddress(value)) return value;
  throw unexpected(`${name} must be a string or a URL`, value);
}

function isAddress(value: unknown): value is string | URL {
  return typeof value === "string" || value instanceof URL;
}

export const callNames = ["onProgress", "signal"] as const;
export const runtimeNames = ["wasmPaths", "threads"] as const;

export function call(options: ModelCallOptions): ModelCallOptions {
  const { onProgress, signal } = check.object("options", options) as ModelCallOptions;
  check.callOptions({ onProgress: onProgress as () => void, signal });
  return { onProgress, signal };
}

export function runtime({ wasmPaths, threads = 1 }: RuntimeOptions): RuntimeOptions {
  return {
    wasmPaths: wasmPaths === undefined ? undefined : pathsOf(wasmPaths),
    threads: check.positive("threads", threads),
  };
}

function pathsOf(value: unknown): WasmPaths {
  if (typeof value === "string") return value;
  // A URL has no property that the runtime would look at.
  if (tag(value) !== "Object")
    throw unexpected("wasmPaths must be a string or { mjs, wasm }", value);
  const { mjs, wasm } = value as Exclude<WasmPaths, string>;
  return {
    ...(mjs !== undefined && { mjs: address("wasmPaths.mjs", mjs) }),
    ...(wasm !== undefined && { wasm: address("wasmPaths.wasm", wasm) }),
  };
}
