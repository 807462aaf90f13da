import { FileError } from "./errors.js";
import { parseDecimal } from "./number.js";

const HEADER = "xt,yt,xr,yr";

/**
 * Reads matches from CSV: xt, yt, xr, yr per row, in pixels.
 *
 * The first line must be the header `xt,yt,xr,yr`. Without this rule a file without header would lose its first match, and
 * another column order would swap the images.
 *
 * @throws {FileError} `invalid-matches`, naming the line; `path` is only for its message.
 */
export function parseMatches(text: string, path: string): Float32Array<ArrayBuffer> {
  const fail = (reason: string): never => {
    throw new FileError("invalid-matches", path, reason);
  };
  const [first = "", ...rows] = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/);
  if (first.replaceAll(/[\s"]/g, "").toLowerCase() !== HEADER)
    fail(`line 1 must be the header ${HEADER}`);

  const values: number[] = [];
  for (const [index, row] of rows.entries()) {
    if (row.trim() === "") continue;
    const line = index + 2;
    const fields = row.split(",").map((field) => field.trim());
    if (fields.length !== 4) fail(`line ${line} has ${fields.length} values, 4 are required`);
    for (const field of fields) {
      const quoted = JSON.stringify(field.slice(0, 40));
      values.push(parseDecimal(field) ?? fail(`line ${line}: ${quoted} is not a number`));
    }
  }
  return Float32Array.from(values);
}
