import { readFile } from "node:fs/promises";

import type { Row } from "./evaluate.js";
import { MEASURES, MEASURE_NAMES, type Group, type MeasureName, type Values } from "./measures.js";
import type { Mean } from "./summarise.js";

/** What a row must reach: at least these scores, at most these errors (of two numbers, the median). */
export type Floor = { readonly [K in MeasureName]?: number } & {
  /** Of a group: how many cases its mean is of. The mean of fewer is left out. */
  readonly cases?: number;
};
export interface Floors {
  /** By how much a row may fall short; 0 where nothing is said. */
  readonly tolerance: { readonly [K in MeasureName]?: number };
  /** By mode (`MODE+own` where the photos are matched anew), then by case or group of cases (`mono-*`, `mean`). */
  readonly modes: Readonly<Record<string, Readonly<Record<string, Floor>>>>;
}

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

/** Compares rows and means of one mode with its floors; floors of cases and groups that were not measured are left out. */
export function checkFloors(
  floors: Floors,
  mode: string,
  rows: readonly Row[],
  means: readonly Mean[],
  groups: ReadonlySet<Group>,
): Check {
  const named = new Map<string, Values & { readonly total?: number; readonly stitched?: number }>([
    ...means.map((mean) => [mean.name, mean] as const),
    ...rows.map((row) => [row.case, row] as const),
  ]);
  const short: string[] = [];
  let checked = 0;
  for (const [name, floor] of Object.entries(floors.modes[mode] ?? {})) {
    const row = named.get(name);
    if (row === undefined || row.total !== floor.cases) continue;
    const measures = MEASURE_NAMES.filter(
      (measure) => floor[measure] !== undefined && groups.has(MEASURES[measure].group),
    );
    if (measures.length === 0) continue;
    checked += 1;
    if (row.stitched !== row.total) {
      short.push(`${mode} ${name}: only ${row.stitched} of ${row.total} cases were stitched`);
    }
    for (const measure of measures) {
      const wanted = floor[measure] ?? NaN;
      const value = valueOf(row, measure);
      const lower = MEASURES[measure].better === "lower";
      const tolerance = floors.tolerance[measure] ?? 0;
      if ((lower ? value - wanted : wanted - value) <= tolerance) continue;
      const found = Number.isNaN(value) ? "nothing" : value.toFixed(3);
      const bound = lower ? "ceiling" : "floor";
      short.push(
        `${mode} ${name}: ${measure} ${found}, ${bound} ${wanted} (tolerance ${tolerance})`,
      );
    }
  }
  return { checked, short };
}

/** A score, or the median of an error; NaN (which is never good enough) when it was not measured. */
function valueOf(row: Values, measure: MeasureName): number {
  const value = row[measure];
  return (typeof value === "number" ? value : value?.[0]) ?? NaN;
}
