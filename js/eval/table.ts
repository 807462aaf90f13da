import type { Row } from "./evaluate.js";
import { milliseconds, type Mean } from "./summarise.js";

const COLUMNS = [
  ["psnr_bbox", 9],
  ["ssim_bbox", 9],
  ["psnr_mask", 9],
  ["ssim_mask", 9],
  ["cover", 6],
  ["matches", 7],
  ["inliers", 7],
  ["in med", 8],
  ["in p90", 8],
  ["out med", 8],
  ["out p90", 8],
  ["ms", 7],
] as const;

type Values = Pick<
  Row,
  | "psnr_bbox"
  | "ssim_bbox"
  | "psnr_mask"
  | "ssim_mask"
  | "cover"
  | "matches"
  | "inliers"
  | "error_inside"
  | "error_outside"
>;

/** The lines of a table whose first column is `width` wide. */
export function tableLines(width: number): {
  readonly header: string;
  readonly row: (row: Row) => string;
  readonly mean: (mean: Mean) => string;
} {
  const line = (name: string, cells: readonly string[], note: string): string => {
    const aligned = COLUMNS.map(([, columnWidth], i) => (cells[i] ?? "").padStart(columnWidth));
    return `${[name.padEnd(width), ...aligned].join("  ")}  ${note}`.trimEnd();
  };
  const header = COLUMNS.map(([name]) => name);
  return {
    header: line("case", header, ""),
    row: (row) => {
      const note = row.failed === undefined ? row.warnings.join(" ") : `FAILED ${row.failed}`;
      return line(row.case, cells(row, milliseconds(row), 0), note);
    },
    mean: (mean) =>
      line(
        mean.name,
        cells(mean, mean.milliseconds, 1),
        `${mean.stitched} of ${mean.total} stitched`,
      ),
  };
}

function cells(values: Values, ms: number | null, countDigits: number): string[] {
  const { error_inside: inside, error_outside: outside } = values;
  return [
    fixed(values.psnr_bbox, 2),
    fixed(values.ssim_bbox, 3),
    fixed(values.psnr_mask, 2),
    fixed(values.ssim_mask, 3),
    fixed(values.cover, 3),
    fixed(values.matches, countDigits),
    fixed(values.inliers, countDigits),
    fixed(inside?.[0] ?? null, 2),
    fixed(inside?.[1] ?? null, 2),
    fixed(outside?.[0] ?? null, 2),
    fixed(outside?.[1] ?? null, 2),
    fixed(ms, 0),
  ];
}

function fixed(value: number | null, digits: number): string {
  return value === null ? "-" : value.toFixed(digits);
}
