// What a value is, in the words of messages.

/** The class of a value, in whatever realm it was made. */
export function tag(value: unknown): string {
  return Object.prototype.toString.call(value).slice(8, -1);
}

/** A value as it appears in a message: strings quoted, objects by their class. */
export function describe(value: unknown): string {
  if (typeof value === "string") return JSON.stringify(value.slice(0, 40));
  if (value === null || value === undefined) return String(value);
  return typeof value === "object" ? tag(value) : typeof value;
}
