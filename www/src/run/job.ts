import type { DepthInput, DepthOutput, Options } from "depthstitch";
import type { Held, Photo, Size } from "../image-worker/contents.js";

/** A depth map of a photo: of a file or a network, or of an earlier result. */
export type JobDepth = DepthInput | Held<DepthOutput>;

/** The complete inputs of a stitch: equal jobs give equal bytes. */
export interface Job {
  readonly target: Photo;
  readonly reference: Photo;
  /** xt, yt, xr, yr in pixels of the scaled photos. Without matches, features are detected and matched. */
  readonly matches?: Float32Array;
  readonly targetDepth?: JobDepth;
  readonly referenceDepth?: JobDepth;
  readonly options: Partial<Options>;
}

const cache = new WeakMap<Float32Array, { key: string; value: Float32Array }>();

/** Converts matches from pixels of the original photos to pixels of the scaled ones. */
export function scaleMatches(matches: Float32Array, target: Photo, reference: Photo): Float32Array {
  const scales = [target, reference].flatMap((photo) => {
    const of = (side: keyof Size) => photo[side] / photo.original[side];
    return [of("width"), of("height")];
  });
  if (scales.every((scale) => scale === 1)) return matches;
  const key = scales.join(" ");
  const cached = cache.get(matches);
  if (cached?.key === key) return cached.value;
  // Pixel centres are integers at both sizes.
  const value = matches.map((at, i) => (at + 0.5) * (scales[i % 4] ?? 1) - 0.5);
  cache.set(matches, { key, value });
  return value;
}

const identities = new WeakMap<object, number>();
let count = 0;

/** A number of its own for every object. Images are compared by identity, as they are immutable. */
export function identityOf(value: object): number {
  const identity = identities.get(value) ?? ++count;
  identities.set(value, identity);
  return identity;
}

/** A key that is equal for equal jobs. */
export function keyOf(job: Job): string {
  const id = (value: object | undefined) => (value ? identityOf(value) : 0);
  const depth = (map: JobDepth | undefined) =>
    map && "held" in map ? map.held : [id(map?.data), map?.kind, map?.invalid];
  return JSON.stringify([
    id(job.target),
    id(job.reference),
    id(job.matches),
    depth(job.targetDepth),
    depth(job.referenceDepth),
    Object.entries(job.options).sort(([a], [b]) => (a < b ? -1 : 1)),
  ]);
}
