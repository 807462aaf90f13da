import type { Row } from "./evaluate.js";
import { mean } from "./statistics.js";
import type { ErrorSummary } from "./truth.js";

/** The mean row of some rows; failed ones are left out, and counted. */
export interface Mean extends Omit<Row, "case" | "mode" | "ms" | "warnings" | "failed"> {
  readonly name: string;
  readonly stitched: number;
  readonly total: number;
  readonly milliseconds: number | null;
}

/** The means of the groups of two or more cases, by the letters that their names begin with, and of all rows. */
export function means(rows: readonly Row[]): Mean[] {
  const groups = new Map<string, Row[]>();
  for (const row of rows) {
    const letters = /^[a-z]+/i.exec(row.case)?.[0] ?? "";
    groups.set(letters, [...(groups.get(letters) ?? []), row]);
  }
  const named = [...groups]
    .filter(([letters, members]) => letters !== "" && members.length > 1)
    .map(([letters, members]) => {
      const dashed = members.every((row) => row.case.startsWith(`${letters}-`));
      return meanOf(dashed ? `${letters}-*` : `${letters}*`, members);
    });
  return [...named, meanOf("mean", rows)];
}

/** Milliseconds of all stages together, or null for a failed row. */
export function milliseconds({ failed, ms }: Row): number | null {
  return failed === undefined ? Object.values(ms).reduce((sum, value) => sum + value, 0) : null;
}

function meanOf(name: string, rows: readonly Row[]): Mean {
  const of = (pick: (row: Row) => number | null): number | null => mean(rows.map(pick)) ?? null;
  const ofErrors = (pick: (row: Row) => ErrorSummary | null): ErrorSummary | null => {
    const median = of((row) => pick(row)?.[0] ?? null);
    const p90 = of((row) => pick(row)?.[1] ?? null);
    return median === null || p90 === null ? null : [median, p90];
  };
  return {
    name,
    stitched: rows.filter(({ failed }) => failed === undefined).length,
    total: rows.length,
    psnr_bbox: of((row) => row.psnr_bbox),
    ssim_bbox: of((row) => row.ssim_bbox),
    psnr_mask: of((row) => row.psnr_mask),
    ssim_mask: of((row) => row.ssim_mask),
    cover: of((row) => row.cover),
    matches: of((row) => row.matches),
    inliers: of((row) => row.inliers),
    error_inside: ofErrors((row) => row.error_inside),
    error_outside: ofErrors((row) => row.error_outside),
    milliseconds: of(milliseconds),
  };
}
