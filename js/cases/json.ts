// JSON files, of which nothing is known before they are checked.
import { FileError } from "./errors.js";

export type Fields = Readonly<Record<string, unknown>>;

/** @throws {FileError} `invalid-case`; `path` is only for its message. */
export function parseJson(text: string, path: string): unknown {
  try {
    return JSON.parse(text);
  } catch (cause) {
    throw new FileError("invalid-case", path, "is not valid JSON", { cause });
  }
}

export function isFields(value: unknown): value is Fields {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Whether a value is a finite number: `1e999` is valid JSON as well. */
export function isFinite(value: unknown): value is number {
  return Number.isFinite(value);
}

/** As many finite numbers, in a list or row by row; undefined for anything else. */
export function numbersOf(value: unknown, count: number): number[] | undefined {
  const flat: unknown[] = Array.isArray(value) ? value.flat() : [];
  return flat.length === count && flat.every(isFinite) ? flat : undefined;
}
