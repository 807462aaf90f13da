// How a call is divided among several workers. The parts are calls as well, of stages whose results the whole takes as inputs: so
// its result is the same, byte by byte, however many workers there are.
import type { Call, CallName, Calls, Result } from "./calls.js";
import type { Performed, Refused } from "./pool.js";
import { buffersOf } from "./transfer.js";
import type { Features, ImageInput, Progress } from "./types.js";

type OnProgress = (progress: Progress) => void;

/** Performs a call in a worker. With `handBack` its arguments come back with the result. */
export type Perform = (call: Call, handBack: boolean, onProgress: OnProgress) => Promise<Performed>;

type CallOf<N extends CallName> = Extract<Call, { name: N }>;

/** Performs a call with so many workers at most. */
export async function performDivided(
  call: Call,
  workers: number,
  perform: Perform,
  onProgress: OnProgress,
): Promise<Performed> {
  if (workers < 2 || (call.name !== "stitch" && call.name !== "align"))
    return perform(call, false, onProgress);
  let begun = false;
  const report = (progress: Progress) => {
    // Detection begins with the inputs, and the whole does so again.
    if (progress.stage === "input" && begun) return;
    begun ||= progress.stage !== "input";
    onProgress(progress);
  };
  const start = performance.now();
  const { prepared, detected } = await withFeatures(call, perform, report);
  const ms = performance.now() - start;
  const whole = await perform(prepared, false, report);
  if (detected && "result" in whole) addTime(whole.result, ms);
  return whole;
}

/**
 * A call whose inputs have the features of both photos, `detected` by one worker each; unless that has no use, or would take too
 * much memory.
 */
async function withFeatures(
  call: CallOf<"stitch"> | CallOf<"align">,
  perform: Perform,
  onProgress: OnProgress,
): Promise<{ prepared: Call; detected: boolean }> {
  const [target, reference, inputs, options] = call.args;
  const { matches, targetDepth, referenceDepth } = inputs;
  const undivided = { prepared: call, detected: false };
  // A buffer can be in one worker only.
  if (matches || buffersOf([target, reference]).size < 2) return undivided;
  const sizes = [sizeOf(target), sizeOf(reference)] as const;
  const depth = [!!targetDepth, !!referenceDepth] as const;
  const affordable: Call = { name: "affordable", args: [sizes, depth, options] };
  const times = await perform(affordable, false, () => undefined);
  if (!("result" in times) || !(Number(times.result) >= 2)) return undivided;

  onProgress({ stage: "input", fraction: 0 });
  const [first, second] = await detectAll([target, reference], options, perform, onProgress);
  if (!first || !second) return undivided;
  // Where the core refused a photo, the whole says why in its own words.
  const detected = "result" in first && "result" in second;
  const features = detected ? ([first.result, second.result] as const) : undefined;
  const args: Calls["stitch"]["args"] = [
    first.args[0],
    second.args[0],
    { ...inputs, features },
    options,
  ];
  return { prepared: { ...call, args }, detected };
}

/** What detection made of a photo, and the photo itself, back from the worker. */
type Detected = ({ result: Features } | Refused) & { args: CallOf<"detect">["args"] };

/** Detects the features of photos. */
function detectAll(
  photos: readonly ImageInput[],
  options: CallOf<"detect">["args"][1],
  perform: Perform,
  onProgress: OnProgress,
): Promise<Detected[]> {
  const done = photos.map(() => 0);
  const detect = async (image: ImageInput, i: number) => {
    const performed = await perform(
      { name: "detect", args: [image, options] },
      true,
      (progress) => {
        done[i] = progress.fraction;
        const fraction = done.reduce((sum, part) => sum + part, 0) / photos.length;
        onProgress({ stage: progress.stage, fraction });
      },
    );
    return performed as Detected;
  };
  return Promise.all(photos.map(detect));
}

const sizeOf = ({ width, height }: ImageInput) => ({ width, height });

/** Adds what detection took to the times of a result. */
function addTime(result: Result, ms: number): void {
  if (typeof result !== "object" || !("times" in result)) return;
  const { input = 0, ...others } = result.times;
  result.times = { input, detect: ms, ...others };
}
