// How a call is divided among several workers. The parts are calls as well, of stages whose results the whole takes as inputs: so
// its result is the same, byte by byte, however many workers there are.
import type { Call, CallName, Result } from "./calls.js";
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
  const division = workers > 1 ? divisionOf(call) : undefined;
  // A buffer can be in one worker only.
  if (!division || buffersOf(division.photos).size < division.photos.length)
    return perform(call, false, onProgress);
  const times = await perform(division.affordable, false, () => undefined);
  if (!("result" in times) || !(Number(times.result) >= 2)) return perform(call, false, onProgress);

  const start = performance.now();
  onProgress({ stage: "input", fraction: 0 });
  const found = await detectAll(division, perform, onProgress);
  const ms = performance.now() - start;
  const features = found.flatMap((one) => ("result" in one ? [one.result] : []));
  const photos = found.map(({ args: [photo] }) => photo);
  // Where the core refused a photo, the whole says why in its own words.
  const detected = features.length === photos.length;
  const whole = division.whole(photos, detected ? features : undefined);
  const performed = await perform(whole, false, (progress) => {
    if (progress.stage !== "input") onProgress(progress);
  });
  if (detected && "result" in performed) addTime(performed.result, ms);
  return performed;
}

/** A call whose photos' features may be detected by several workers. */
interface Division {
  photos: readonly ImageInput[];
  options: CallOf<"detect">["args"][1];
  /** Says how many times over there is enough memory for it. */
  affordable: Call;
  /** Whether progress names the photo. */
  named: boolean;
  /** The whole, given its photos back and their features. */
  whole: (photos: readonly ImageInput[], features: readonly Features[] | undefined) => Call;
}

/** Undefined for a call that one worker performs. */
function divisionOf(call: Call): Division | undefined {
  switch (call.name) {
    case "stitch":
    case "align": {
      const [target, reference, inputs, options] = call.args;
      if (inputs.matches) return undefined;
      const sizes = [sizeOf(target), sizeOf(reference)] as const;
      const depth = [!!inputs.targetDepth, !!inputs.referenceDepth] as const;
      return {
        photos: [target, reference],
        options,
        affordable: { name: "affordable", args: [sizes, depth, options] },
        named: false,
        whole: ([first = target, second = reference], features) => ({
          ...call,
          args: [first, second, { ...inputs, features }, options],
        }),
      };
    }
    case "stitchMany": {
      const [photos, inputs, options] = call.args;
      return {
        photos,
        options,
        affordable: { name: "affordableMany", args: [photos.map(sizeOf), options] },
        named: true,
        // What is known of a photo besides its pixels has stayed here.
        whole: (images, features) => ({
          ...call,
          args: [
            photos.map((photo, i) => ({ ...photo, ...images[i] })),
            { ...inputs, features },
            options,
          ],
        }),
      };
    }
    default:
      return undefined;
  }
}

const sizeOf = ({ width, height }: ImageInput) => ({ width, height });

/** What detection made of a photo, and the photo itself, back from the worker. */
type Detected = ({ result: Features } | Refused) & { args: CallOf<"detect">["args"] };

function detectAll(
  { photos, options, named }: Division,
  perform: Perform,
  onProgress: OnProgress,
): Promise<Detected[]> {
  const done = photos.map(() => 0);
  const detect = async ({ data, width, height }: ImageInput, photo: number) => {
    const call: Call = { name: "detect", args: [{ data, width, height }, options] };
    const performed = await perform(call, true, ({ stage, fraction }) => {
      done[photo] = fraction;
      const sum = done.reduce((sum, part) => sum + part, 0);
      onProgress({ stage, fraction: sum / photos.length, ...(named && { photo }) });
    });
    return performed as Detected;
  };
  return Promise.all(photos.map(detect));
}

/** Adds what detection took to the times of a result. */
function addTime(result: Result, ms: number): void {
  if (typeof result !== "object" || !("times" in result)) return;
  const { input = 0, ...others } = result.times;
  result.times = { input, detect: ms, ...others };
}
