import { UnusableFile } from "./unusable-file.js";

const header = "xt,yt,xr,yr";

/**
 * Reads a matches file: the header `xt,yt,xr,yr`, then one match a line, target point and reference point in pixels.
 *
 * @throws {UnusableFile} naming the line that is wrong
 */
export function parseMatches(text: string, file: string): Float32Array {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/);
  const first = (lines[0] ?? "").toLowerCase().replaceAll(/[\s"]/g, "");
  if (first !== header) {
    throw new UnusableFile(
      `${file} does not begin with the header ${header}. Each further line holds one match: target x, y, reference x, y.`,
    );
  }
  const values: number[] = [];
  for (const [index, line] of lines.entries()) {
    if (index === 0 || line.trim() === "") continue;
    const cells = line.split(",");
    const numbers = cells.map((cell) => (cell.trim() === "" ? Number.NaN : Number(cell)));
    if (numbers.length !== 4 || !numbers.every(Number.isFinite)) {
      throw new UnusableFile(
        `Line ${index + 1} of ${file} is not four numbers: “${line.slice(0, 60)}”.`,
      );
    }
    values.push(...numbers);
  }
  if (values.length === 0) throw new UnusableFile(`${file} has a header but no matches.`);
  return new Float32Array(values);
}
