import { invalid } from "../errors.js";
import { orAborted, throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import { colours, resample } from "../models/resample.js";
import { openSession } from "../models/runtime.js";
import type { Size } from "../types.js";
import { estimator } from "./estimator.js";
import type { DepthEstimator, OnnxDepthOptions } from "./types.js";

const names = ["weights", "inputSize", "mean", "std", "output", "device", "cache"];

/**
 * Loads a depth network from a single ONNX file, for example FastDepth (`output: "metric"`). Requires the package
 * `onnxruntime-web`.
 *
 * @throws {StitchError} `invalid-argument`, `model-load-failed`, `aborted`.
 */
export async function loadOnnxDepth(options: OnnxDepthOptions): Promise<DepthEstimator> {
  const { weights, mean, std, inputSize, output, device, cache, ...how } = check.read(() =>
    checked(options),
  );
  throwIfAborted(how.signal);

  const session = await openSession(weights, { ...how, device, cache });
  const [, , height = inputSize?.height, width = inputSize?.width] = session.inputs[0]?.dims ?? [];
  if (width === undefined || height === undefined) {
    await session.dispose();
    throw invalid("inputSize must be given for a network with dynamic input size");
  }

  return estimator({
    device,
    output,
    async predict(photo, signal) {
      const data = resample(colours(photo), width, height);
      const area = width * height;
      for (let c = 0; c < 3; c++) {
        const [shift, scale] = [mean[c] ?? 0, std[c] ?? 1];
        for (let i = c * area; i < (c + 1) * area; i++)
          data[i] = ((data[i] ?? 0) / 255 - shift) / scale;
      }
      const input = { data, dims: [1, 3, height, width] };
      return orAborted(session.run([input]), signal);
    },
    dispose: () => session.dispose(),
  });
}

function checked(options: OnnxDepthOptions) {
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { output = "inverse", device = "wasm", cache = true, inputSize } = options;
  const { mean = [0, 0, 0], std = [1, 1, 1] } = options;
  return {
    weights: check.weights("weights", options.weights),
    inputSize: inputSize === undefined ? undefined : sizeOf(inputSize),
    mean: check.triple("mean", mean),
    std: check.triple("std", std, 0),
    output: check.oneOf("output", output, "inverse", "metric"),
    device: check.oneOf("device", device, "wasm", "webgpu"),
    cache: check.boolean("cache", cache),
    ...check.call(options),
    ...check.runtime(options),
  };
}

function sizeOf(value: unknown): Size {
  const { width, height } = check.size("inputSize", value);
  return {
    width: check.positive("inputSize.width", width),
    height: check.positive("inputSize.height", height),
  };
}
