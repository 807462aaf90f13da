/**
 * The part that only one photo shows, measured: the outer part of the overlap is cut off the reference, what is left is
 * stitched, and the mosaic is compared with what was cut off.
 */
import type { Case } from "../cases/case.js";
import {
  crop,
  stitch,
  type DepthInput,
  type ImageOutput,
  type Options,
  type Rect,
  type StitchResult,
} from "../index.js";
import { compare, type Comparison } from "./comparison.js";
import { onPlane, type Mode } from "./modes.js";

/** Share of the overlap that is hidden. */
const HIDDEN = 0.4;
/** The overlap ends where this share of its pixels is reached. */
const OVERLAP = 0.9;
/** A narrower part says nothing. */
const LEAST = 20;

/** How a reference is cut in two. */
export interface Cut {
  /** What is hidden, in pixels of the reference. */
  readonly hidden: Rect;
  /** What is left. */
  readonly left: Rect;
  /** Share of the hidden part that the target covers. */
  readonly covered: number;
  /** The matches of the whole photos: xt, yt, xr, yr. */
  readonly matches: Float32Array;
}

/**
 * Cuts off the outer part of the overlap, on the side where the mosaic reaches farthest beyond the reference. The photos
 * are stitched with whatever is known of them, so that the part is the same for every mode. Undefined where the overlap
 * is too narrow.
 */
export async function cutReference(input: Case): Promise<Cut | undefined> {
  const { target, reference, matches, targetDepth, referenceDepth } = input;
  const options = onPlane({ matches, targetDepth, referenceDepth, fill: "none" as const });
  const whole = await stitch(target, reference, options);
  const cut = divide(reference, whole);
  return cut && { ...cut, matches: matches ?? whole.matches };
}

/** The geometry of {@link cutReference}. */
export function divide(
  reference: { readonly width: number; readonly height: number },
  { warped, offset }: Pick<StitchResult, "warped" | "offset">,
): Omit<Cut, "matches"> | undefined {
  const { width, height } = reference;
  const covered = (x: number, y: number): number =>
    warped.data[4 * ((y + offset.y) * warped.width + x + offset.x) + 3] === 0 ? 0 : 1;
  const reaches = {
    left: offset.x,
    right: warped.width - offset.x - width,
    top: offset.y,
    bottom: warped.height - offset.y - height,
  };
  const sides = ["left", "right", "top", "bottom"] as const;
  const side = sides.reduce((best, other) => (reaches[other] > reaches[best] ? other : best));
  const horizontal = side === "left" || side === "right";
  const profile = new Array<number>(horizontal ? width : height).fill(0);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const i = horizontal ? x : y;
      profile[i] = (profile[i] ?? 0) + covered(x, y);
    }
  }
  // From the outside in.
  if (side === "right" || side === "bottom") profile.reverse();
  const total = profile.reduce((sum, count) => sum + count, 0);
  let [sum, end] = [0, 0];
  while (end < profile.length && sum < OVERLAP * total) sum += profile[end++] ?? 0;
  const depth = Math.round(HIDDEN * end);
  if (depth < LEAST) return undefined;
  const hidden = {
    x: side === "right" ? width - depth : 0,
    y: side === "bottom" ? height - depth : 0,
    width: horizontal ? depth : width,
    height: horizontal ? height : depth,
  };
  const left = {
    x: side === "left" ? depth : 0,
    y: side === "top" ? depth : 0,
    width: horizontal ? width - depth : width,
    height: horizontal ? height : height - depth,
  };
  let count = 0;
  for (let y = hidden.y; y < hidden.y + hidden.height; y++) {
    for (let x = hidden.x; x < hidden.x + hidden.width; x++) count += covered(x, y);
  }
  return { hidden, left, covered: count / (hidden.width * hidden.height) };
}

/** Stitches what is left, and compares the mosaic with what is hidden. Undefined where it hardly shows any of it. */
export async function compareHidden(
  input: Case,
  cut: Cut,
  mode: Mode,
  { settings, ownMatches }: { settings: Partial<Options>; ownMatches: boolean },
): Promise<(Comparison & { readonly shown: number }) | undefined> {
  const { hidden, left } = cut;
  const { reference, referenceDepth } = input;
  const options = onPlane({
    ...mode.settings,
    ...settings,
    matches: ownMatches ? undefined : matchesIn(cut.matches, left),
    targetDepth: mode.depth ? input.targetDepth : undefined,
    referenceDepth: mode.depth ? depthIn(referenceDepth, reference, left) : undefined,
  });
  const result = await stitch(input.target, crop(reference, left), options);
  const found = compare(shownOf(result, hidden, left), crop(reference, hidden));
  if (!found) return undefined;
  return { ...found, shown: Math.min(1, found.share / Math.max(cut.covered, 1e-6)) };
}

/** What the mosaic has of the hidden part, fills left out. */
function shownOf(
  { mosaic, voidMask, offset }: StitchResult,
  hidden: Rect,
  left: Rect,
): ImageOutput {
  const data = new Uint8ClampedArray(4 * hidden.width * hidden.height);
  for (let y = 0; y < hidden.height; y++) {
    for (let x = 0; x < hidden.width; x++) {
      const [column, row] = [x + hidden.x - left.x + offset.x, y + hidden.y - left.y + offset.y];
      const outside = column < 0 || row < 0 || column >= mosaic.width || row >= mosaic.height;
      const from = row * mosaic.width + column;
      if (outside || voidMask.data[from] !== 0) continue;
      data.set(mosaic.data.subarray(4 * from, 4 * from + 4), 4 * (y * hidden.width + x));
    }
  }
  return { data, width: hidden.width, height: hidden.height };
}

function matchesIn(matches: Float32Array, { x, y, width, height }: Rect): Float32Array {
  const inside = [];
  for (let i = 0; i < matches.length; i += 4) {
    const [xt = NaN, yt = NaN, xr = NaN, yr = NaN] = matches.subarray(i, i + 4);
    if (xr >= x && xr < x + width && yr >= y && yr < y + height)
      inside.push(xt, yt, xr - x, yr - y);
  }
  return Float32Array.from(inside);
}

/** The part of a depth map of the photo's size; none of another size, whose pixels cannot be cut. */
function depthIn(
  depth: DepthInput | undefined,
  size: { readonly width: number; readonly height: number },
  { x, y, width, height }: Rect,
): DepthInput | undefined {
  if (depth?.width !== size.width || depth.height !== size.height) return undefined;
  const data = new Float32Array(width * height);
  for (let row = 0; row < height; row++) {
    const from = (row + y) * depth.width + x;
    data.set(depth.data.subarray(from, from + width), row * width);
  }
  return { ...depth, data, width, height };
}
