import type { Pair } from "../cases/case.js";
import { median } from "../eval/statistics.js";
import { stitch, type Stage, type StitchOptions } from "../index.js";

/** The stages, as timed by the core, and the whole call including copies. */
export const STAGES = [
  "detect",
  "match",
  "estimate",
  "depth",
  "refine",
  "warp",
  "measure",
  "blend",
  "fill",
  "stitch",
] as const satisfies readonly (Stage | "stitch")[];

/** Median milliseconds per stage. */
export type Times = Readonly<Partial<Record<(typeof STAGES)[number], number>>>;

/**
 * The published method with the matches and depth maps of the case; the default method with its depth maps; the default
 * method with the two images only.
 */
export const METHODS = ["paper", "depth", "photos"] as const;
export type Method = (typeof METHODS)[number];

/** Times `runs` stitches on this thread after `warmUp` runs that are not counted. */
export async function timeStages(
  pair: Pair,
  method: Method,
  runs: number,
  warmUp: number,
): Promise<Times> {
  const samples = await timed(pair, { ...inputs(pair, method), worker: false }, runs, warmUp);
  return Object.fromEntries(
    STAGES.flatMap((stage) => {
      const times = samples.flatMap((sample) => sample[stage] ?? []);
      return times.length > 0 ? [[stage, median(times)]] : [];
    }),
  );
}

/** Median milliseconds of the whole call in so many workers, which are started anew for none but the first. */
export async function timeWhole(
  pair: Pair,
  method: Method,
  workers: 1 | 2,
  runs: number,
  warmUp: number,
): Promise<number> {
  const samples = await timed(pair, { ...inputs(pair, method), workers }, runs, warmUp);
  return median(samples.map(({ stitch }) => stitch));
}

/** The times of `runs` stitches; the runs before, `warmUp` of them, include compilation and growth of memory. */
async function timed(
  { target, reference }: Pair,
  options: StitchOptions,
  runs: number,
  warmUp: number,
): Promise<(Times & { readonly stitch: number })[]> {
  const samples = [];
  for (let run = -warmUp; run < runs; run++) {
    const start = performance.now();
    const { times } = await stitch(target, reference, options);
    const whole = performance.now() - start;
    if (run >= 0) samples.push({ ...times, stitch: whole });
  }
  return samples;
}

/** What `stitch` is given besides the photos. */
export function inputs(
  { matches, targetDepth, referenceDepth }: Pair,
  method: Method,
): StitchOptions {
  switch (method) {
    case "paper":
      return { mode: "paper", matches, targetDepth, referenceDepth };
    case "depth":
      return { targetDepth, referenceDepth };
    case "photos":
      return {};
  }
}
