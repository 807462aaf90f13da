/**
 * Depth maps from photos, by networks that are loaded only when they are asked for. The photo stays on this machine; the
 * network is downloaded to it.
 *
 * {@link loadDepthModel} needs the package `@huggingface/transformers`, {@link loadOnnxDepth} the package
 * `onnxruntime-web`. Work is done on the calling thread: call from a worker of your own where a page must not stand still.
 */
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
 * The depth of one photo: loads the model, looks, and gives its memory back. For several photos load it once.
 *
 * @throws {StitchError} as {@link loadDepthModel} and `estimate` of what it returns.
 */
export async function estimateDepth(
  image: ImageInput,
  options: DepthModelOptions = {},
): Promise<EstimatedDepth> {
  const estimator = await loadDepthModel(options);
  try {
    const { onProgress, signal } = options;
    return await estimator.estimate(image, { onProgress, signal });
  } finally {
    await estimator.dispose();
  }
}
