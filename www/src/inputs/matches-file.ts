import { UnusableFile } from "../unusable-file.js";

const header = "xt,yt,xr,yr";

/**
 * Reads a matches file: the header `xt,yt,xr,yr`, then one match a line, target point and reference point in pixels.
 *
 * @throws {UnusableFile} naming the line that is wrong
 */
export function parseMatches(text: string, { name, type, size }: File): Float32Array {
  if (size === 0) throw new UnusableFile(`${name} is empty.`);
  if (type.startsWith("image/")) {
    throw new UnusableFile(`${name} is a picture. Choose a CSV file with the header ${header}.`);
  }
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/);
  const first = (lines[0] ?? "").toLowerCase().replaceAll(/[\s"]/g, "");
  if (first !== header) {
    throw new UnusableFile(
      `${name} does not begin with the header ${header}. Each further line holds one match: target x, y, reference x, y.`,
    );
  }
  const values: number[] = [];
  for (const [index, line] of lines.entries()) {
    if (index === 0 || line.trim() === "") continue;
    const cells = line.split(",");
    const numbers = cells.map((cell) => (cell.trim() === "" ? Number.NaN : Number(cell)));
    if (numbers.length !== 4 || !numbers.every(Number.isFinite)) {
      throw new UnusableFile(
        `Line ${index + 1} of ${name} is not four numbers: “${line.slice(0, 60)}”.`,
      );
    }
    values.push(...numbers);
  }
  if (values.length === 0) throw new UnusableFile(`${name} has a header but no matches.`);
  return new Float32Array(values);
}
