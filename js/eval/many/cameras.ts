import type { StitchManyResult } from "../../index.js";
import { median } from "../statistics.js";
import { angle, minus, product, times, transposed, turn, type Point } from "./matrices.js";
import type { TrueCamera } from "./set.js";

/** How far the cameras found are from the true ones: medians, in degrees over all pairs, in per cent over all photos. */
export interface CameraErrors {
  /** Of the relative rotation. */
  readonly rotation: number;
  /** Of the direction of the relative translation. */
  readonly direction: number;
  /** Of the focal length. */
  readonly focal: number;
}

/** Null where no two photos have a camera. */
export function cameraErrors(
  photos: StitchManyResult["photos"],
  truth: readonly TrueCamera[],
): CameraErrors | null {
  const known = photos.flatMap(({ camera, focalLength }, i) => {
    const own = truth[i];
    if (!camera || focalLength === null || !own) return [];
    const { rotation, translation } = camera;
    const found = { R: Array.from(rotation), t: Array.from(translation) };
    return [{ found, own, focal: focalLength / ((own.K[0] ?? NaN) / 2 + (own.K[4] ?? NaN) / 2) }];
  });
  const [rotations, directions]: [number[], number[]] = [[], []];
  known.forEach((from, i) => {
    for (const to of known.slice(i + 1)) {
      const [a, b] = [motion(from.found, to.found), motion(from.own, to.own)];
      rotations.push(turn(product(a.R, transposed(b.R))));
      directions.push(angle(a.t, b.t));
    }
  });
  if (rotations.length === 0) return null;
  const focals = known.map(({ focal }) => 100 * Math.abs(focal - 1));
  return { rotation: median(rotations), direction: median(directions), focal: median(focals) };
}

interface Pose {
  readonly R: readonly number[];
  readonly t: readonly number[];
}

/** From the coordinates of one camera to those of another. */
function motion(from: Pose, to: Pose): { R: number[]; t: Point } {
  const R = product(to.R, transposed(from.R));
  return { R, t: minus(point(to.t), times(R, point(from.t))) };
}

function point([x = NaN, y = NaN, z = NaN]: readonly number[]): Point {
  return [x, y, z];
}
