import { invalid } from "./errors.js";

/**
 * A copy of `value` whose typed arrays can be transferred. With `transfer` the caller's buffers are taken over, which
 * empties the caller's arrays. Views of a part of a buffer are always copied, as the rest of the buffer is not ours.
 */
export function ownedCopy<T>(value: T, transfer: boolean): T {
  const copied = copy(value, (view) => transfer && view.byteLength === view.buffer.byteLength);
  if (!transfer) return copied;
  try {
    return structuredClone(copied, { transfer: [...buffersOf(copied)] });
  } catch (cause) {
    throw invalid(`an input cannot be transferred: ${String(cause)}`);
  }
}

/** A deep copy that shares those typed arrays for which `isShared` holds. */
function copy<T>(value: T, isShared: (view: ArrayBufferView) => boolean): T;
function copy(value: unknown, isShared: (view: ArrayBufferView) => boolean): unknown {
  if (typeof value !== "object" || value === null) return value;
  if (ArrayBuffer.isView(value)) return isShared(value) ? value : (value as Uint8Array).slice();
  if (Array.isArray(value)) return value.map((part: unknown) => copy(part, isShared));
  return Object.fromEntries(
    Object.entries(value).map(([key, part]) => [key, copy(part, isShared)]),
  );
}

/** The distinct buffers of all typed arrays inside `value`. */
export function buffersOf(value: unknown, found = new Set<ArrayBuffer>()): Set<ArrayBuffer> {
  if (ArrayBuffer.isView(value)) {
    if (value.buffer instanceof ArrayBuffer) found.add(value.buffer);
  } else if (typeof value === "object" && value !== null) {
    for (const part of Object.values(value)) buffersOf(part, found);
  }
  return found;
}
