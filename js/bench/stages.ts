import type { Pair } from "../cases/case.js";
import { median } from "../eval/statistics.js";
import { stitch, type StitchOptions } from "../index.js";

/** What is timed: the stages, as the core itself times them, and the whole call with its copies in and out. */
export const STAGES = ["estimate", "warp", "blend", "fill", "measure", "stitch"] as const;

/** Median milliseconds. */
export type Times = Readonly<Record<(typeof STAGES)[number], number>>;

/** Times `runs` stitches with default options on this thread, after `warmUp` that do not count. */
export async function timeStages(pair: Pair, runs: number, warmUp: number): Promise<Times> {
  const { target, reference, matches, targetDepth, referenceDepth } = pair;
  const options: StitchOptions = { matches, targetDepth, referenceDepth, worker: false };
  const samples: Times[] = [];
  for (let run = -warmUp; run < runs; run++) {
    const start = performance.now();
    const { times } = await stitch(target, reference, options);
    const whole = performance.now() - start;
    // The first runs pay for compilation and for the growth of memory.
    if (run >= 0) samples.push({ ...times, stitch: whole });
  }
  const of = (stage: (typeof STAGES)[number]): number =>
    median(samples.map((times) => times[stage]));
  return {
    estimate: of("estimate"),
    warp: of("warp"),
    blend: of("blend"),
    fill: of("fill"),
    measure: of("measure"),
    stitch: of("stitch"),
  };
}
