import { invalid } from "./errors.js";

/**
 * `value` with typed arrays of its own. With `transfer` the caller's buffers are taken, which empties the caller's
 * arrays; an array that covers only a part of its buffer is copied all the same, as the rest is not ours to take.
 */
export function own<T>(value: T, transfer: boolean): T {
  const copied = copy(value, (view) => transfer && view.byteLength === view.buffer.byteLength);
  if (!transfer) return copied;
  try {
    return structuredClone(copied, { transfer: [...buffersOf(copied)] });
  } catch (cause) {
    throw invalid(`an input cannot be transferred: ${String(cause)}`);
  }
}

/** A deep copy, except that typed arrays for which `keep` holds stay the same. */
function copy<T>(value: T, keep: (view: ArrayBufferView) => boolean): T;
function copy(value: unknown, keep: (view: ArrayBufferView) => boolean): unknown {
  if (typeof value !== "object" || value === null) return value;
  if (ArrayBuffer.isView(value)) return keep(value) ? value : (value as Uint8Array).slice();
  if (Array.isArray(value)) return value.map((part: unknown) => copy(part, keep));
  return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, copy(part, keep)]));
}

/** Every buffer that typed arrays inside `value` view, each once. */
export function buffersOf(value: unknown, found = new Set<ArrayBuffer>()): Set<ArrayBuffer> {
  if (ArrayBuffer.isView(value)) {
    if (value.buffer instanceof ArrayBuffer) found.add(value.buffer);
  } else if (typeof value === "object" && value !== null) {
    for (const part of Object.values(value)) buffersOf(part, found);
  }
  return found;
}
