import { readFile } from "node:fs/promises";

import type { Row } from "./evaluate.js";
import type { Mean } from "./summarise.js";

/** What a row must reach: at least these scores, at most these median errors in pixels. */
export type Floor = { readonly [K in Measure]?: number } & {
  /** Of a group: how many cases its mean is of. The mean of fewer is left out. */
  readonly cases?: number;
};
export interface Floors {
  /** By how much a row may fall short. */
  readonly tolerance: { readonly [K in Measure]: number };
  /** By mode, then by case or group of cases (`mono-*`). */
  readonly modes: Readonly<Record<string, Readonly<Record<string, Floor>>>>;
}

const MEASURES = ["psnr_bbox", "ssim_bbox", "cover", "error_inside", "error_outside"] as const;
type Measure = (typeof MEASURES)[number];
type Checked = Pick<Row, Measure>;

/** The reference figures: what the published method has to reach, and what our own way did. */
export async function readFloors(): Promise<Floors> {
  // From dist/eval as from js/eval.
  const text = await readFile(new URL("../../js/eval/floors.json", import.meta.url), "utf8");
  return JSON.parse(text) as Floors;
}

/** How the rows of one mode compare with its floors. */
export interface Check {
  /** Rows that have a floor. */
  readonly checked: number;
  /** One line per number that falls short. */
  readonly short: readonly string[];
}

/** Compares rows and means of one mode with its floors; floors of cases that did not run are left out. */
export function checkFloors(
  floors: Floors,
  mode: string,
  rows: readonly Row[],
  means: readonly Mean[],
): Check {
  const named = new Map<string, Checked & { readonly total?: number }>([
    ...means.map((mean) => [mean.name, mean] as const),
    ...rows.map((row) => [row.case, row] as const),
  ]);
  const short: string[] = [];
  let checked = 0;
  for (const [name, floor] of Object.entries(floors.modes[mode] ?? {})) {
    const row = named.get(name);
    if (row === undefined || row.total !== floor.cases) continue;
    checked += 1;
    for (const measure of MEASURES) {
      const least = floor[measure];
      if (least === undefined) continue;
      const value = valueOf(row, measure);
      const gap = measure.startsWith("error") ? value - least : least - value;
      if (gap <= floors.tolerance[measure]) continue;
      const found = Number.isNaN(value) ? "nothing" : value.toFixed(3);
      short.push(
        `${mode} ${name}: ${measure} ${found}, floor ${least} (tolerance ${floors.tolerance[measure]})`,
      );
    }
  }
  return { checked, short };
}

/** A score, or the median of an error; NaN (which is never good enough) when it was not measured. */
function valueOf(row: Checked, measure: Measure): number {
  const value = row[measure];
  return (typeof value === "number" ? value : value?.[0]) ?? NaN;
}
