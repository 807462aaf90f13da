import type { Pair } from "../cases/case.js";
import { median } from "../eval/statistics.js";
import { stitch, type Stage, type StitchOptions } from "../index.js";

/** What is timed: the stages, as the core itself times them, and the whole call with its copies in and out. */
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

/** Median milliseconds of what was gone through. */
export type Times = Readonly<Partial<Record<(typeof STAGES)[number], number>>>;

/**
 * What is given: the published method with the case's matches and depth maps; our own way with its depth maps; and with
 * the two photos alone.
 */
export const WAYS = ["paper", "depth", "photos"] as const;
export type Way = (typeof WAYS)[number];

/** Times `runs` stitches on this thread, after `warmUp` that do not count. */
export async function timeStages(
  pair: Pair,
  way: Way,
  runs: number,
  warmUp: number,
): Promise<Times> {
  const { target, reference } = pair;
  const options: StitchOptions = { ...inputs(pair, way), worker: false };
  const samples: Times[] = [];
  for (let run = -warmUp; run < runs; run++) {
    const start = performance.now();
    const { times } = await stitch(target, reference, options);
    const whole = performance.now() - start;
    // The first runs pay for compilation and for the growth of memory.
    if (run >= 0) samples.push({ ...times, stitch: whole });
  }
  return Object.fromEntries(
    STAGES.flatMap((stage) => {
      const times = samples.flatMap((sample) => sample[stage] ?? []);
      return times.length > 0 ? [[stage, median(times)]] : [];
    }),
  );
}

/** What `stitch` is given besides the photos. */
export function inputs({ matches, targetDepth, referenceDepth }: Pair, way: Way): StitchOptions {
  switch (way) {
    case "paper":
      return { mode: "paper", matches, targetDepth, referenceDepth };
    case "depth":
      return { targetDepth, referenceDepth };
    case "photos":
      return {};
  }
}
