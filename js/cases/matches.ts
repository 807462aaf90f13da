import { FileError } from "./errors.js";

const HEADER = "xt,yt,xr,yr";

/**
 * The matches of a CSV file: xt, yt, xr, yr per row, in pixels (centres at integers, origin top left).
 *
 * The first line must be the header `xt,yt,xr,yr`: its absence would silently cost the first match, another order would
 * silently swap the photos.
 *
 * @throws FileError `invalid-matches`, naming the line.
 */
export function parseMatches(text: string, path: string): Float32Array {
  const lines = text.split(/\r\n|\n|\r/);
  const header = (lines[0] ?? "").replaceAll(/[\s"]/g, "").toLowerCase();
  if (header !== HEADER)
    throw new FileError("invalid-matches", path, `line 1 must be the header ${HEADER}`);

  const values: number[] = [];
  for (const [index, line] of lines.entries()) {
    if (index === 0 || line.trim() === "") continue;
    const fields = line.split(",");
    if (fields.length !== 4) {
      throw new FileError(
        "invalid-matches",
        path,
        `line ${index + 1} has ${fields.length} values, 4 are needed`,
      );
    }
    for (const field of fields) values.push(parseNumber(field, index + 1, path));
  }
  return Float32Array.from(values);
}

function parseNumber(field: string, line: number, path: string): number {
  const text = field.trim();
  const value = Number(text);
  // Number() takes "", "0x10" and "Infinity" too.
  if (!/^[+-]?[\d.]+(e[+-]?\d+)?$/i.test(text) || !Number.isFinite(value)) {
    throw new FileError(
      "invalid-matches",
      path,
      `line ${line}: ${JSON.stringify(text.slice(0, 40))} is no number`,
    );
  }
  return value;
}
