// What a value is, in the words of messages.
import { invalid, type StitchError } from "./errors.js";

/** The class of a value, in whatever realm it was made. */
export function tag(value: unknown): string {
  return Object.prototype.toString.call(value).slice(8, -1);
}

/** An `invalid-argument` error: what was expected, and what was given instead. */
export function unexpected(expected: string, value: unknown): StitchError {
  const details = typeof value === "number" ? { value } : {};
  return invalid(`${expected}, got ${describe(value)}`, details);
}

/** A value as it appears in a message: strings quoted, objects by their class. */
function describe(value: unknown): string {
  if (typeof value === "string") return JSON.stringify(value.slice(0, 40));
  if (typeof value === "number" || value === null || value === undefined) return String(value);
  return typeof value === "object" ? tag(value) : typeof value;
}
