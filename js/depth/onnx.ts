import { invalid } from "../errors.js";
import { orAborted, throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import { colours, resample } from "../models/resample.js";
import { openSession } from "../models/runtime.js";
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
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { output = "inverse", device = "wasm", cache = true } = options;
  check.oneOf("output", output, "inverse", "metric");
  check.oneOf("device", device, "wasm", "webgpu");
  const weights = check.weights("weights", options.weights);
  const mean = triple("mean", options.mean ?? [0, 0, 0]);
  const std = triple("std", options.std ?? [1, 1, 1]);
  const { onProgress, signal } = check.call(options);
  const runtime = check.runtime(options);
  const given = options.inputSize && {
    width: check.positive("inputSize.width", options.inputSize.width),
    height: check.positive("inputSize.height", options.inputSize.height),
  };
  throwIfAborted(signal);

  const session = await openSession(weights, { ...runtime, onProgress, signal, device, cache });
  const [, , height = given?.height, width = given?.width] = session.inputs[0]?.dims ?? [];
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

function triple(name: string, value: readonly number[]): readonly number[] {
  if (value.length === 3 && value.every((part) => Number.isFinite(part))) return value;
  throw invalid(`${name} must be three numbers, for red, green and blue`);
}
