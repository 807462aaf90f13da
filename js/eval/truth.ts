import type { Truth } from "../cases/case.js";
import { FileError } from "../cases/errors.js";
import type { DepthInput, ImageInput, Model } from "../index.js";
import type { ErrorSummary } from "./measures.js";
import { median, percentile } from "./statistics.js";

/** How far the fitted map is from the true one; null where there are too few points to say. */
export interface TruthError {
  /** Where the true map leads into the reference. */
  readonly inside: ErrorSummary | null;
  /** Where it leads elsewhere, up to `FAR` pixels away: how well the geometry extrapolates. */
  readonly outside: ErrorSummary | null;
}

/** Every how many-th pixel of the target is looked at. */
export const STEP = 4;
/** Points that truly lie farther than this from the origin, in either coordinate, do not count. */
export const FAR = 3000;
/** A summary needs more points than this. */
const FEW = 20;

/**
 * Distance in pixels between where the fitted and where the true map put the target's pixels.
 *
 * The fitted map takes the inverse depth that the target was warped with (`used`), the true map the true one: that of
 * the case (`given`) unless the truth has its own. Pixels where either of these two is unknown, or the true one is not
 * positive, are left out.
 */
export function truthError(
  fitted: Model,
  used: DepthInput,
  truth: Truth,
  given: DepthInput,
  reference: Pick<ImageInput, "width" | "height">,
): TruthError {
  const { width, height } = given;
  const [known, warped] = [inverseDepth(given), inverseDepth(used)];
  const trueDepth = truth.inverseDepth?.data ?? known;
  const points = [];
  for (let y = 0; y < height; y += STEP) {
    for (let x = 0; x < width; x += STEP) {
      const d = warped[y * width + x] ?? NaN;
      const t = trueDepth[y * width + x] ?? NaN;
      if (!Number.isFinite(known[y * width + x]) || !Number.isFinite(t) || t <= 0) continue;
      const [u, v] = project(fitted, x, y, d);
      const [a, b, w] = project(truth, x, y, t);
      points.push({ a, b, w, error: Math.hypot(u - a, v - b) });
    }
  }
  // A model is known up to its sign: the side that most points are on is the front.
  const front = Math.sign(median(points.map(({ w }) => w)));
  const isInside = ({ a, b, w }: { a: number; b: number; w: number }): boolean =>
    a >= 0 && b >= 0 && a < reference.width && b < reference.height && w * front > 0;
  const inside = points.filter(isInside);
  const outside = points.filter((p) => !isInside(p) && Math.abs(p.a) < FAR && Math.abs(p.b) < FAR);
  return { inside: summary(inside), outside: summary(outside) };
}

/** Checks that truth and depth can be compared pixel by pixel with the target. */
export function checkTruth(
  name: string,
  truth: Truth,
  depth: DepthInput | undefined,
  target: Pick<ImageInput, "width" | "height">,
): void {
  const expected = `${target.height},${target.width}`;
  const fail = (what: string, found: string): never => {
    throw new FileError(
      "invalid-case",
      name,
      `${what} must be of the target's size (${expected}), is ${found}`,
    );
  };
  const found = depth ? `${depth.height},${depth.width}` : "missing";
  if (found !== expected) fail("the depth map of a case with truth", found);
  const shape = truth.inverseDepth?.shape.join() ?? expected;
  if (shape !== expected) fail("truth_inverse_depth.npy", shape);
}

/** Inverse depth of a map; NaN where a metric one is not positive. */
export function inverseDepth({ data, kind }: DepthInput): Float32Array {
  return Float32Array.from(data, (value) =>
    kind === "inverse" ? value : value > 0 ? 1 / value : NaN,
  );
}

/** Image of (x, y) with inverse depth d: u, v and the third homogeneous coordinate. */
export function project(
  { h, e }: { readonly h: ArrayLike<number>; readonly e: ArrayLike<number> },
  x: number,
  y: number,
  d: number,
): [u: number, v: number, w: number] {
  const row = (i: number): number =>
    (h[3 * i] ?? NaN) * x + (h[3 * i + 1] ?? NaN) * y + (h[3 * i + 2] ?? NaN) + (e[i] ?? NaN) * d;
  const w = row(2);
  return [row(0) / w, row(1) / w, w];
}

/** Median and 90th percentile of the errors; null of few points. */
export function summary(points: readonly { readonly error: number }[]): ErrorSummary | null {
  if (points.length <= FEW) return null;
  // A point that the fitted map sends nowhere is as wrong as can be.
  const errors = points.map(({ error }) => (Number.isNaN(error) ? Infinity : error));
  return [median(errors), percentile(errors, 90)];
}
