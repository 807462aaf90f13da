import type { ImageInput } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, Weights } from "../models/types.js";

/**
 * Inverse depth at the resolution of the network: larger is nearer, NaN where a metric network predicted no positive
 * depth. Pass it as `targetDepth` or `referenceDepth`, which are resampled.
 */
export interface EstimatedDepth {
  data: Float32Array<ArrayBuffer>;
  width: number;
  height: number;
  kind: "inverse";
}

/** A depth network that is ready to run. */
export interface DepthEstimator {
  /** Where the network runs; `cpu` in Node. */
  readonly device: "webgpu" | "wasm" | "cpu";
  /**
   * Estimates the depth of an image.
   *
   * @throws {StitchError} `invalid-argument`, `size-mismatch`, `model-load-failed` if the network cannot be run,
   * `aborted`.
   */
  estimate(image: ImageInput, options?: ModelCallOptions): Promise<EstimatedDepth>;
  /** Releases the network, which cannot be used afterwards. */
  dispose(): Promise<void>;
}

/** What a network predicts: inverse depth (larger is nearer) or distance. */
export type DepthOutput = "inverse" | "metric";

/** A model in the folder layout of the library: `config.json`, `preprocessor_config.json`, `onnx/model.onnx`. */
export interface DepthModel {
  /** For example `onnx-community/depth-anything-v2-small`. */
  id: string;
  /**
   * Commit, tag or branch; only a commit guarantees that the same files are loaded every time. Required for downloads from
   * the Hugging Face Hub, otherwise `"main"` by default.
   */
  revision?: string | undefined;
  /** Default `"inverse"`. */
  output?: DepthOutput | undefined;
}

/** Options of `loadDepthModel`. */
export interface DepthModelOptions extends ModelCallOptions, RuntimeOptions {
  /** Depth Anything V2 Small at a fixed commit (default `"small"`), or another depth model. */
  model?: "small" | DepthModel | undefined;
  /** Default `"auto"`: in browsers WebGPU if available, otherwise wasm; in Node the CPU. */
  device?: "auto" | "webgpu" | "wasm" | "cpu" | undefined;
  /**
   * Data type of the weights: `"fp32"`, `"fp16"`, `"q8"`, `"q4"`, `"q4f16"` … By default `"fp16"` on GPUs that support it,
   * `"q8"` on wasm, otherwise `"fp32"`.
   */
  dtype?: string | undefined;
  /** URL that models are downloaded from (default: the Hugging Face Hub). */
  host?: string | URL | undefined;
  /** Path of a model on that host (default `"{model}/resolve/{revision}/"`). */
  path?: string | undefined;
  /** Folder (Node) or URL (browsers) with a folder per model id. Nothing is downloaded from elsewhere then. */
  local?: string | undefined;
  /** Whether browsers cache downloads (default `true`). In Node they are always cached. */
  cache?: boolean | undefined;
  /** Cache folder in Node. By default inside the library. */
  cacheDir?: string | undefined;
}

/** Options of `loadOnnxDepth`. */
export interface OnnxDepthOptions extends ModelCallOptions, RuntimeOptions {
  /** A network from one image, [1, 3, height, width], to one map. */
  weights: Weights;
  /** Size that images are resized to. Required for networks with dynamic input size. */
  inputSize?: { width: number; height: number } | undefined;
  /** Mean of red, green and blue, which is subtracted from values in 0 to 1 (default 0). */
  mean?: readonly [number, number, number] | undefined;
  /** Standard deviation of red, green and blue, above 0, by which values are then divided (default 1). */
  std?: readonly [number, number, number] | undefined;
  /** Default `"inverse"`. A metric network's output is inverted. */
  output?: DepthOutput | undefined;
  /** Default `"wasm"`. */
  device?: "wasm" | "webgpu" | undefined;
  /** Whether browsers cache downloads (default `true`). */
  cache?: boolean | undefined;
}
