import { modelError } from "../models/errors.js";
import type { DepthOutput, EstimatedDepth } from "./types.js";

/** A network's output, whose last two sides are height and width, as inverse depth of the package's own. */
export function toInverse(
  data: ArrayLike<number>,
  dims: readonly number[],
  output: DepthOutput,
): EstimatedDepth {
  const [height = 0, width = 0] = dims.slice(-2);
  if (data.length === 0 || data.length !== width * height) {
    throw modelError(`the network's output is no map but [${dims.join(", ")}]`, undefined, {
      values: data.length,
    });
  }
  const inverse = new Float32Array(data);
  if (output === "metric") {
    inverse.forEach((depth, i) => (inverse[i] = depth > 0 ? 1 / depth : NaN));
  }
  return { data: inverse, width, height, kind: "inverse" };
}
