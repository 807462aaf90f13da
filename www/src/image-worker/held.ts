/** The large arrays that the image worker holds: pictures and maps, which the main thread would take too long to copy. */
import type { Held, Pixels } from "./contents.js";

interface Entry {
  /** Null for what was taken. */
  value: Pixels | null;
  /** Makes what was taken once more. */
  readonly again: (() => Promise<Pixels>) | null;
  /** How many tasks are working on it. */
  readers: number;
}

/** What is larger is moved instead of copied, if it can be made again: copies in memory at the same time are worse than a second decoding. */
const mostCopied = 32e6;

const entries = new Map<number, Entry>();
/** Never that of a worker before, whose arrays are gone. */
let last = Math.floor(performance.timeOrigin) * 1000;

export function hold<T extends Pixels>(value: T, again: (() => Promise<T>) | null = null): Held<T> {
  const { data, ...rest } = value;
  entries.set(++last, { value, again, readers: 0 });
  return { ...rest, held: last, bytes: data.byteLength };
}

export function release(held: number): void {
  entries.delete(held);
}

/** An array for as long as a task works on it: until `endReading`. */
export async function read(handle: Held): Promise<Pixels> {
  const entry = entryOf(handle);
  entry.readers++;
  entry.value ??= (await entry.again?.()) ?? null;
  if (!entry.value) throw lost();
  return entry.value;
}

export function endReading({ held }: Held): void {
  const entry = entries.get(held);
  if (entry) entry.readers--;
}

/** An array for the caller to keep: a copy, or the only one there is if that can be made again. */
export async function take(handle: Held): Promise<Pixels> {
  const entry = entryOf(handle);
  const value = await read(handle);
  entry.readers--;
  const stays = !entry.again || entry.readers > 0 || handle.bytes <= mostCopied;
  if (stays) return { ...value, data: value.data.slice() };
  entry.value = null;
  return value;
}

function entryOf({ held }: Held): Entry {
  const entry = entries.get(held);
  if (!entry) throw lost();
  return entry;
}

function lost(): Error {
  return new Error("The page has lost this picture for lack of memory. Load the photos again.");
}
