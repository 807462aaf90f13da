// Checks of what the callers of the networks pass. The core sees none of it, so values are checked here, too.
import * as check from "../check.js";
import { invalid, StitchError } from "../errors.js";
import type { ImageInput, Mask, Size } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, Weights } from "./types.js";

/** A picture whose buffer is as long as its size says. */
export function image(name: string, value: ImageInput): ImageInput {
  return sized(name, check.image(name, value), 4);
}

/** A mask of the same size as a picture. */
export function maskOf(name: string, value: Mask, size: Size): Mask {
  const mask = sized(name, check.mask(name, value), 1);
  if (mask.width !== size.width || mask.height !== size.height) {
    const details = { width: mask.width, height: mask.height };
    const message = `${name} is ${mask.width}×${mask.height}, the picture ${size.width}×${size.height}`;
    throw new StitchError({ code: "size-mismatch", stage: "input", message, details });
  }
  return mask;
}

function sized<T extends Size & { data: ArrayLike<number> }>(
  name: string,
  value: T,
  channels: number,
): T {
  positive(`${name}.width`, value.width);
  positive(`${name}.height`, value.height);
  const expected = channels * value.width * value.height;
  const actual = value.data.length;
  if (actual === expected) return value;
  const message = `${name}.data has ${actual} values instead of ${expected}`;
  const details = { expected, actual };
  throw new StitchError({ code: "size-mismatch", stage: "input", message, details });
}

/** A whole number above zero. */
export function positive(name: string, value: unknown): number {
  if (typeof value === "number" && Number.isInteger(value) && value > 0) return value;
  const details = typeof value === "number" ? { value } : {};
  throw invalid(`${name} must be a whole number above 0, got ${String(value)}`, details);
}

/** A whole number from 0. */
export function count(name: string, value: unknown): number {
  return value === 0 ? 0 : positive(name, value);
}

export function oneOf<T extends string>(name: string, value: unknown, ...choices: T[]): T {
  const chosen = choices.find((choice) => choice === value);
  if (chosen !== undefined) return chosen;
  const words = choices.map((choice) => `"${choice}"`).join(" or ");
  throw invalid(`${name} must be ${words}, got ${String(value)}`);
}

/** Refuses options of other names, as a typing error in one would go unnoticed. */
export function known(options: object, names: readonly string[]): void {
  for (const name of Object.keys(options)) {
    if (!names.includes(name)) throw invalid(`there is no option ${name}`);
  }
}

export function weights(name: string, value: Weights): string | URL | Uint8Array {
  if (typeof value === "string" || value instanceof URL) return value;
  return check.bytes(name, value);
}

export const callNames = ["onProgress", "signal"] as const;
export const runtimeNames = ["wasmPaths", "threads"] as const;

export function call({ onProgress, signal }: ModelCallOptions): ModelCallOptions {
  check.callOptions({ onProgress: onProgress as () => void, signal });
  return { onProgress, signal };
}

export function runtime({ wasmPaths, threads = 1 }: RuntimeOptions): RuntimeOptions {
  return { wasmPaths, threads: positive("threads", threads) };
}
