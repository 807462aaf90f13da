import type { TrueMap } from "../../cases/case-file.js";
import type { DepthInput, Size, StitchManyResult } from "../../index.js";
import { FAR, STEP, inverseDepth, project, summary, type TruthError } from "../truth.js";
import { product, times, transposed, type Point } from "./matrices.js";
import type { TrueCamera } from "./set.js";

/**
 * Distance in pixels between where the pixels of all photos land in the reference's view and where they should: of those
 * that another photo's frame contains, and of the rest. What the reference sees behind itself or very far to the side is
 * left out.
 *
 * @param depths the true depth of each photo.
 */
export function landingErrors(
  { photos, reference, distortion }: Pick<StitchManyResult, "photos" | "reference" | "distortion">,
  cameras: readonly TrueCamera[],
  depths: readonly DepthInput[],
): TruthError {
  const middle = middleOf(photos[reference]?.undistorted ?? depths[reference]);
  const shown = middleOf(depths[reference]);
  const points = photos.flatMap(({ forward, inverseDepth: found, undistorted }, photo) => {
    const [own, exact] = [cameras[photo], depths[photo]];
    if (photo === reference || !forward || !own || !exact) return [];
    const maps = cameras.map((camera) => trueMap(own, camera));
    const size = exact;
    const within = ([u, v, w]: Point): boolean =>
      w > 0 && u >= 0 && v >= 0 && u < size.width && v < size.height;
    const truth = inverseDepth(exact);
    const frame = undistorted ?? size;
    const place = (x: number, y: number): readonly [number, number] =>
      undistorted ? withoutDistortion(distortion, size, undistorted, [x, y]) : [x, y];
    const landed = [];
    for (let y = 0; y < size.height; y += STEP) {
      for (let x = 0; x < size.width; x += STEP) {
        const i = y * size.width + x;
        const t = truth[i] ?? NaN;
        if (!(t > 0)) continue;
        const seen = maps.map((map) => project(map, x, y, t));
        const [a, b, w] = seen[reference] ?? [NaN, NaN, NaN];
        if (!(w > 0 && Math.abs(a) < FAR && Math.abs(b) < FAR)) continue;
        const [p, q] = place(x, y);
        const at = Math.round(q) * frame.width + Math.round(p);
        const [u, v] = project(forward, p, q, found?.data[at] ?? 0);
        const error = Math.hypot(u - middle[0] + shown[0] - a, v - middle[1] + shown[1] - b);
        const shared = seen.some((spot, other) => other !== photo && within(spot));
        landed.push({ error, shared });
      }
    }
    return landed;
  });
  return {
    inside: summary(points.filter(({ shared }) => shared)),
    outside: summary(points.filter(({ shared }) => !shared)),
  };
}

function middleOf(size: Size | undefined): readonly [number, number] {
  return size ? [(size.width - 1) / 2, (size.height - 1) / 2] : [NaN, NaN];
}

/** Where a pixel of a photo is in the frame of the photo without distortion. */
function withoutDistortion(
  k: number,
  size: Size,
  frame: Size,
  [x, y]: readonly [number, number],
): readonly [number, number] {
  const [[cx, cy], [left, top]] = [middleOf(size), middleOf(frame)];
  const square = ((x - cx) ** 2 + (y - cy) ** 2) / (size.width ** 2 + size.height ** 2);
  return [left + (x - cx) / (1 + k * square), top + (y - cy) / (1 + k * square)];
}

/** From one true camera's pixels to another's, by the inverse depth in the first. */
function trueMap(from: TrueCamera, to: TrueCamera): TrueMap {
  const rotation = product(to.R, transposed(from.R));
  const [f, , cx, , g, cy] = from.K as readonly [number, number, number, number, number, number];
  const back = [1 / f, 0, -cx / f, 0, 1 / g, -cy / g, 0, 0, 1];
  const moved = times(rotation, from.t as Point);
  const t = to.t.map((value, i) => value - (moved[i] ?? NaN)) as unknown as Point;
  return { h: product(to.K, product(rotation, back)), e: times(to.K, t) };
}
