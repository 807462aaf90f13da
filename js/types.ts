import type { Depths, Mask, Options, Stage, StitchInputs } from "./wasm/types.js";

export type {
  Alignment,
  DepthInput,
  DepthOutput,
  Depths,
  EstimateInputs,
  Features,
  FitReport,
  Geometry,
  ImageInput,
  ImageMatches,
  ImageOutput,
  Mask,
  Matches,
  Model,
  Models,
  Mosaic,
  Options,
  Quality,
  Rect,
  Remark,
  Size,
  Stage,
  StitchInputs,
  StitchResult,
  Warped,
} from "./wasm/types.js";

/** Where a wasm file is, for bundlers that cannot say: its address, or its bytes. */
export type WasmSource = string | URL | ArrayBuffer | Uint8Array<ArrayBuffer>;

/** How far a call has come. */
export interface Progress {
  stage: Stage;
  /** How much of the stage is done, 0 to 1. */
  fraction: number;
}

/** How a call runs, not what it computes. */
export interface CallOptions {
  /** Called as the work goes on. An exception thrown here stops the work and rejects the call. */
  onProgress?: ((progress: Progress) => void) | undefined;
  /**
   * Stops the work. The call rejects at once with a `StitchError` named `"AbortError"`. With `worker: false` it is
   * looked at before the work and whenever progress is reported.
   */
  signal?: AbortSignal | undefined;
  /**
   * Whether to work in a worker thread (the default) or on the calling one, which then reads the inputs where they are:
   * they must not change until the call is done.
   */
  worker?: boolean | undefined;
  /**
   * Whether the worker may take the inputs' buffers instead of copying them (default `false`). The caller's arrays are
   * empty afterwards. An array that covers only a part of its buffer is copied all the same.
   */
  transfer?: boolean | undefined;
}

/** The core's settings, each optional. */
export type Settings = { [K in keyof Options]?: Options[K] | undefined };

export interface StitchOptions extends Settings, StitchInputs, CallOptions {}
export interface MatchOptions extends Settings, CallOptions {}
export interface EstimateOptions extends Settings, CallOptions {}
export interface WarpOptions extends Settings, Depths, CallOptions {}
export interface BlendOptions extends Settings, CallOptions {
  /** Reference pixels whose alignment is believed: the seam keeps away from elsewhere. */
  readonly trusted?: Mask | null | undefined;
}
export interface FillOptions extends Settings, CallOptions {}
