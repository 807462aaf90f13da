import type { Row } from "./evaluate.js";
import { MEASURE_NAMES, type MeasureName, type Values } from "./measures.js";
import { mean } from "./statistics.js";

/** The mean row of some rows; failed ones are left out, and counted. */
export interface Mean extends Values {
  readonly name: string;
  readonly stitched: number;
  readonly total: number;
  /** Of how many rows the mean of a measure is, if not of all that were stitched. */
  readonly fewer: Readonly<Partial<Record<MeasureName, number>>>;
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
  const of = (measure: MeasureName): number | readonly number[] | null => {
    const values = rows.map((row) => row[measure]);
    const errors = values.filter((value) => typeof value === "object" && value !== null);
    if (errors.length === 0)
      return mean(values.filter((value) => typeof value === "number")) ?? null;
    const parts = [0, 1].map((i) => mean(errors.map((error) => error[i])));
    return parts.some((part) => part === undefined) ? null : (parts as number[]);
  };
  const values = Object.fromEntries(MEASURE_NAMES.map((measure) => [measure, of(measure)]));
  const stitched = rows.filter(({ failed }) => failed === undefined).length;
  const counts = MEASURE_NAMES.map((measure) => {
    return [measure, rows.filter((row) => row[measure] !== null).length] as const;
  });
  return {
    ...(values as unknown as Values),
    name,
    stitched,
    total: rows.length,
    fewer: Object.fromEntries(counts.filter(([, count]) => count > 0 && count < stitched)),
    milliseconds: mean(rows.map(milliseconds)) ?? null,
  };
}
