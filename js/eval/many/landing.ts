import type { DepthInput, StitchManyResult } from "../../index.js";
import { FAR, STEP, inverseDepth, project, summary, type TruthError } from "../truth.js";
import { product, times, transposed, type Point } from "./matrices.js";
import type { TrueCamera } from "./set.js";

interface Map {
  readonly h: number[];
  readonly e: readonly number[];
}

/**
 * Distance in pixels between where the pixels of all photos land in the reference's view and where they should: of those
 * that another photo's frame contains, and of the rest. What the reference sees behind itself or very far to the side is
 * left out.
 *
 * @param depths the true depth of each photo.
 */
export function landingErrors(
  { photos, reference }: Pick<StitchManyResult, "photos" | "reference">,
  cameras: readonly TrueCamera[],
  depths: readonly DepthInput[],
): TruthError {
  const points = photos.flatMap(({ forward, inverseDepth: found }, photo) => {
    const [own, exact] = [cameras[photo], depths[photo]];
    if (photo === reference || !forward || !own || !exact) return [];
    const maps = cameras.map((camera) => trueMap(own, camera));
    const size = exact;
    const within = ([u, v, w]: Point): boolean =>
      w > 0 && u >= 0 && v >= 0 && u < size.width && v < size.height;
    const truth = inverseDepth(exact);
    const landed = [];
    for (let y = 0; y < size.height; y += STEP) {
      for (let x = 0; x < size.width; x += STEP) {
        const i = y * size.width + x;
        const t = truth[i] ?? NaN;
        if (!(t > 0)) continue;
        const seen = maps.map((map) => project(map, x, y, t));
        const [a, b, w] = seen[reference] ?? [NaN, NaN, NaN];
        if (!(w > 0 && Math.abs(a) < FAR && Math.abs(b) < FAR)) continue;
        const [u, v] = project(forward, x, y, found?.data[i] ?? 0);
        const shared = seen.some((place, other) => other !== photo && within(place));
        landed.push({ error: Math.hypot(u - a, v - b), shared });
      }
    }
    return landed;
  });
  return {
    inside: summary(points.filter(({ shared }) => shared)),
    outside: summary(points.filter(({ shared }) => !shared)),
  };
}

/** From one true camera's pixels to another's, by the inverse depth in the first. */
function trueMap(from: TrueCamera, to: TrueCamera): Map {
  const rotation = product(to.R, transposed(from.R));
  const [f, , cx, , g, cy] = from.K as readonly [number, number, number, number, number, number];
  const back = [1 / f, 0, -cx / f, 0, 1 / g, -cy / g, 0, 0, 1];
  const moved = times(rotation, from.t as Point);
  const t = to.t.map((value, i) => value - (moved[i] ?? NaN)) as unknown as Point;
  return { h: product(to.K, product(rotation, back)), e: times(to.K, t) };
}
