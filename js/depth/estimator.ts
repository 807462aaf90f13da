import { throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import type { ImageInput } from "../types.js";
import { toInverse } from "./map.js";
import type { DepthEstimator, DepthOutput } from "./types.js";

/** A network's output, whose last two dimensions are height and width. */
export interface Prediction {
  readonly data: ArrayLike<number>;
  readonly dims: readonly number[];
}

/** Wraps a network: checks arguments, reports progress and converts the output to inverse depth. */
export function estimator(
  network: Pick<DepthEstimator, "device" | "dispose"> & {
    readonly output: DepthOutput;
    predict(photo: ImageInput, signal: AbortSignal | undefined): Promise<Prediction>;
  },
): DepthEstimator {
  return {
    device: network.device,
    async estimate(image, call = {}) {
      const { photo, onProgress, signal } = check.read(() => ({
        photo: check.image("image", image),
        ...check.call(call),
      }));
      throwIfAborted(signal);
      onProgress?.({ stage: "run", fraction: 0 });
      const { data, dims } = await network.predict(photo, signal);
      const depth = toInverse(data, dims, network.output);
      onProgress?.({ stage: "run", fraction: 1 });
      return depth;
    },
    dispose: () => network.dispose(),
  };
}
