import { throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import type { ImageInput } from "../types.js";
import { toInverse } from "./map.js";
import type { DepthEstimator, DepthOutput } from "./types.js";

/** What a network says of a photo: numbers whose last two sides are height and width. */
interface Prediction {
  readonly data: ArrayLike<number>;
  readonly dims: readonly number[];
}

/** A network that is ready, as the package shows it: calls are checked, progress is told, and what comes out is inverse depth. */
export function estimator(
  network: Pick<DepthEstimator, "device" | "dispose"> & {
    readonly output: DepthOutput;
    predict(photo: ImageInput, signal: AbortSignal | undefined): Promise<Prediction>;
  },
): DepthEstimator {
  return {
    device: network.device,
    async estimate(image, call = {}) {
      const photo = check.image("image", image);
      const { onProgress, signal } = check.call(call);
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
