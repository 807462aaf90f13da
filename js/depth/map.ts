import { modelError } from "../models/errors.js";
import type { DepthOutput, EstimatedDepth } from "./types.js";

/** Converts a network's output, whose last two dimensions are height and width, to inverse depth. */
export function toInverse(
  data: ArrayLike<number>,
  dims: readonly number[],
  output: DepthOutput,
): EstimatedDepth {
  const [height = 0, width = 0] = dims.slice(-2);
  if (data.length === 0 || data.length !== width * height) {
    throw modelError(`the network's output must be a map, got [${dims.join(", ")}]`, undefined, {
      values: data.length,
    });
  }
  const inverse = new Float32Array(data);
  if (output === "metric") {
    inverse.forEach((depth, i) => (inverse[i] = depth > 0 ? 1 / depth : NaN));
  }
  return { data: inverse, width, height, kind: "inverse" };
}
