import type { ImageInput } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, Weights } from "../models/types.js";

/**
 * Inverse depth as a network sees it, at the network's own resolution: larger is nearer, NaN where a metric network gave no
 * positive depth. Fits `targetDepth` and `referenceDepth`, which resample it.
 */
export interface EstimatedDepth {
  data: Float32Array<ArrayBuffer>;
  width: number;
  height: number;
  kind: "inverse";
}

/** A depth network, ready to look at photos. */
export interface DepthEstimator {
  /** Where the network runs: `cpu` is Node's. */
  readonly device: "webgpu" | "wasm" | "cpu";
  /**
   * @throws {StitchError} `invalid-argument`, `size-mismatch`, `model-load-failed` where the network cannot be run,
   * `aborted`.
   */
  estimate(image: ImageInput, options?: ModelCallOptions): Promise<EstimatedDepth>;
  /** Gives the network's memory back. It cannot be used afterwards. */
  dispose(): Promise<void>;
}

/** What a network's numbers are: larger for nearer things, or a distance. */
export type DepthOutput = "inverse" | "metric";

/** A model of the library's own folder format: `config.json`, `preprocessor_config.json`, `onnx/model.onnx`. */
export interface DepthModel {
  /** For example `onnx-community/depth-anything-v2-small`. */
  id: string;
  /** Branch, tag or commit (default `"main"`). */
  revision?: string | undefined;
  /** Default `"inverse"`. */
  output?: DepthOutput | undefined;
}

export interface DepthModelOptions extends ModelCallOptions, RuntimeOptions {
  /** Depth Anything V2 in one of its sizes (default `"small"`), or another depth model. */
  model?: "small" | "base" | "large" | DepthModel | undefined;
  /** Default `"auto"`: in browsers WebGPU if there is a GPU, else wasm; in Node the CPU. */
  device?: "auto" | "webgpu" | "wasm" | "cpu" | undefined;
  /**
   * Which of the model's files: `"fp32"`, `"fp16"`, `"q8"`, `"q4"`, `"q4f16"` … By default `"fp16"` on a GPU that has it,
   * `"q8"` on wasm, else `"fp32"`.
   */
  dtype?: string | undefined;
  /** Where models are downloaded from (default the Hugging Face Hub). */
  host?: string | URL | undefined;
  /** The folder of a model on that host (default `"{model}/resolve/{revision}/"`). */
  path?: string | undefined;
  /** A folder (in Node) or address (in browsers) with a folder for every model id: nothing is downloaded then. */
  local?: string | undefined;
  /** Whether the browser keeps what was downloaded (default `true`). Node always does. */
  cache?: boolean | undefined;
  /** Where Node keeps it. By default with the library itself. */
  cacheDir?: string | undefined;
}

export interface OnnxDepthOptions extends ModelCallOptions, RuntimeOptions {
  /** A network from one picture, [1, 3, height, width], to one map. */
  weights: Weights;
  /** What the photo is resized to. Needed only for networks that take every size. */
  inputSize?: { width: number; height: number } | undefined;
  /** Subtracted from red, green and blue, which are 0 to 1 (default 0). */
  mean?: readonly [number, number, number] | undefined;
  /** What they are then divided by (default 1). */
  std?: readonly [number, number, number] | undefined;
  /** Default `"inverse"`. A metric network's output is inverted. */
  output?: DepthOutput | undefined;
  /** Default `"wasm"`. */
  device?: "wasm" | "webgpu" | undefined;
  /** Whether the browser keeps what was downloaded (default `true`). */
  cache?: boolean | undefined;
}
