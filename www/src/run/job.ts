import type { DepthInput, Options } from "depthstitch";
import { depthNetworkOf, depthSlot, type Message, type PhotoSlot, type State } from "../state.js";
import type { Photo, Size } from "../studio/contents.js";

/** Everything that a stitch is computed from, and nothing else: the same job, the same bytes. */
export interface Job {
  readonly target: Photo;
  readonly reference: Photo;
  /** xt, yt, xr, yr in pixels of the photos as they are here. Without them, features are detected and matched. */
  readonly matches?: Float32Array;
  readonly targetDepth?: DepthInput;
  readonly referenceDepth?: DepthInput;
  readonly options: Partial<Options>;
}

/** What the present inputs and settings ask for, or what is still needed, in words. */
export function jobOf({ slots, settings, modelDepths, loading }: State): Job | Message {
  const note = (title: string, advice: string): Message => ({ tone: "note", title, advice });
  if (loading.size > 0) return note("A file is still being read.", "Stitch again in a moment.");
  const target = slots.target?.content;
  const reference = slots.reference?.content;
  if (!target && !reference) {
    return note("Two photos are needed.", "Choose both, or begin with the example.");
  }
  if (!target) return note("The first photo is missing.", "Choose the photo that is to be moved.");
  if (!reference) return note("The second photo is missing.", "Choose the photo that stays.");

  const depthOf = (slot: PhotoSlot): DepthInput | undefined => {
    if (settings.depthSource === "files") {
      const map = slots[depthSlot[slot]]?.content;
      return map && { ...map, ...settings.depth };
    }
    const made =
      settings.depthSource === "model" && slots[slot] && modelDepths.get(slots[slot].content);
    return made && made.model === depthNetworkOf(settings)
      ? { ...made.map, kind: "inverse" }
      : undefined;
  };
  const targetDepth = depthOf("target");
  const referenceDepth = depthOf("reference");
  const focalLength = settings.options.focalLength ?? focalLengthOf(target);
  return {
    target,
    reference,
    ...(slots.matches && { matches: scaled(slots.matches.content, target, reference) }),
    ...(targetDepth && { targetDepth }),
    ...(referenceDepth && { referenceDepth }),
    options: { ...settings.options, ...(focalLength !== null && { focalLength }) },
  };
}

/** The focal length in pixels of a photo whose file says it; film of 35 mm has a diagonal of 43.27 mm. */
export function focalLengthOf({ focalLength35, width, height }: Photo): number | null {
  return focalLength35 === null ? null : (focalLength35 * Math.hypot(width, height)) / 43.27;
}

const scaledMatches = new WeakMap<Float32Array, { key: string; value: Float32Array }>();

/** Matches of the files' pixels in those of photos that were scaled. Pixel centres are whole numbers at both sizes. */
function scaled(matches: Float32Array, target: Photo, reference: Photo): Float32Array {
  const scales = [target, reference].flatMap((photo) => {
    const of = (side: keyof Size) => photo[side] / photo.original[side];
    return [of("width"), of("height")];
  });
  if (scales.every((scale) => scale === 1)) return matches;
  const key = scales.join(" ");
  const known = scaledMatches.get(matches);
  if (known?.key === key) return known.value;
  const value = matches.map((at, i) => (at + 0.5) * (scales[i % 4] ?? 1) - 0.5);
  scaledMatches.set(matches, { key, value });
  return value;
}

const identities = new WeakMap<object, number>();
let count = 0;

/** Equal for equal jobs. Inputs are told apart by identity: none of them ever changes. */
export function keyOf(job: Job): string {
  const id = (value: object | undefined) => {
    if (!value) return 0;
    const known = identities.get(value) ?? ++count;
    identities.set(value, known);
    return known;
  };
  const depth = (map: DepthInput | undefined) => [id(map?.data), map?.kind, map?.invalid];
  return JSON.stringify([
    id(job.target),
    id(job.reference),
    id(job.matches),
    depth(job.targetDepth),
    depth(job.referenceDepth),
    Object.entries(job.options).sort(([a], [b]) => (a < b ? -1 : 1)),
  ]);
}
