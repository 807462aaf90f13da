/**
 * Monocular depth estimation by networks that are downloaded on demand. Images are processed locally and never uploaded.
 *
 * {@link loadDepthModel} requires the package `@huggingface/transformers`, {@link loadOnnxDepth} the package
 * `onnxruntime-web`. Networks run on the calling thread: to keep a page responsive, call them from a worker.
 */
import * as check from "../models/check.js";
import { loadDepthModel } from "./anything.js";
import type { DepthModelOptions, EstimatedDepth } from "./types.js";
import type { ImageInput } from "../types.js";

export { loadDepthModel } from "./anything.js";
export { loadOnnxDepth } from "./onnx.js";
export { StitchError, type ErrorCode, type ErrorStage } from "../errors.js";
export type { ImageInput } from "../types.js";
export type {
  ModelCallOptions,
  ModelProgress,
  RuntimeOptions,
  WasmPaths,
  Weights,
} from "../models/types.js";
export type * from "./types.js";

/**
 * Estimates the depth of one image: loads the model, runs it, and releases it. For several images, load it once.
 *
 * @throws {StitchError} as {@link loadDepthModel} and `DepthEstimator.estimate`.
 */
export async function estimateDepth(
  image: ImageInput,
  options: DepthModelOptions = {},
): Promise<EstimatedDepth> {
  // Nothing is downloaded for one that cannot be used.
  const photo = check.read(() => check.image("image", image));
  const estimator = await loadDepthModel(options);
  try {
    const { onProgress, signal } = options;
    return await estimator.estimate(photo, { onProgress, signal });
  } finally {
    await estimator.dispose();
  }
}
