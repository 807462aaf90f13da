import type { Pair } from "../cases/case.js";
import { blend, estimate, fill, measure, stitch, warp, type CallOptions } from "../index.js";
import { median } from "../eval/statistics.js";

/** What is timed: each stage alone, then the whole way. `estimate` is the robust fit and both refinements. */
export const STAGES = ["estimate", "warp", "blend", "fill", "measure", "stitch"] as const;

/** Median milliseconds. */
export type Times = Readonly<Record<(typeof STAGES)[number], number>>;

/** Runs that are thrown away first: they pay for compilation and for the growth of memory. */
const WARM_UP = 3;

/** Times every stage on this thread, with default options; copying to and from the core counts. */
export async function timeStages(pair: Pair, runs: number): Promise<Times> {
  const { target, reference, matches, targetDepth, referenceDepth } = pair;
  const here: CallOptions = { worker: false };
  const depths = { targetDepth, referenceDepth };
  const inputs = { targetSize: target, referenceSize: reference, matches, ...depths };
  const time = <T>(work: () => Promise<T>): Promise<{ result: T; ms: number }> => timed(work, runs);

  const estimated = await time(() => estimate(inputs, here));
  const warped = await time(() =>
    warp(target, reference, estimated.result, { ...depths, ...here }),
  );
  const blended = await time(() => blend(warped.result, reference, here));
  const filled = await time(() => fill(blended.result.mosaic, blended.result.voidMask, here));
  const measured = await time(() => measure(warped.result, reference, here));
  const stitched = await time(() => stitch(target, reference, { matches, ...depths, ...here }));
  return {
    estimate: estimated.ms,
    warp: warped.ms,
    blend: blended.ms,
    fill: filled.ms,
    measure: measured.ms,
    stitch: stitched.ms,
  };
}

/** The last result of `work`, and the median of its times over `runs` runs after a warm-up. */
export async function timed<T>(
  work: () => Promise<T>,
  runs: number,
  warmUp = WARM_UP,
): Promise<{ result: T; ms: number }> {
  let result = await work();
  for (let i = 1; i < warmUp; i++) result = await work();
  const times: number[] = [];
  for (let i = 0; i < runs; i++) {
    const start = performance.now();
    result = await work();
    times.push(performance.now() - start);
  }
  return { result, ms: median(times) };
}
