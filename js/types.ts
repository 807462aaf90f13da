import type {
  Depths,
  ManyInputs,
  Mask,
  Options,
  Output,
  Stage,
  StitchInputs,
  StitchResult,
} from "./wasm/types.js";

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
  ManyInputs,
  Mask,
  Matches,
  Model,
  Models,
  Mosaic,
  Options,
  Output,
  PhotoCode,
  PhotoInput,
  PhotoPair,
  PhotoReport,
  Quality,
  Rect,
  Size,
  Stage,
  StitchInputs,
  StitchManyResult,
  StitchResult,
  Warning,
  WarningCode,
  Warped,
} from "./wasm/types.js";

/** A wasm file, for bundlers that do not find it by themselves: its URL or its bytes. */
export type WasmSource = string | URL | ArrayBuffer | Uint8Array<ArrayBuffer>;

/** Progress of a call. */
export interface Progress {
  stage: Stage;
  /** Completed fraction of the stage, 0 to 1. */
  fraction: number;
  /** Of `stitchMany`: index of the photo that is worked on, if it is one. */
  photo?: number;
  /** Of `stitchMany`: indices of the pair that is worked on, if it is one, ascending. */
  pair?: readonly [first: number, second: number];
}

/** Options of how a call is run; they do not change its result. */
export interface CallOptions {
  /** Called as work progresses. An exception thrown here stops the work and rejects the call. */
  onProgress?: ((progress: Progress) => void) | undefined;
  /**
   * Aborts the call, which rejects at once with a `StitchError` named `"AbortError"`. With `worker: false` the signal is
   * checked before the work starts and whenever progress is reported.
   */
  signal?: AbortSignal | undefined;
  /**
   * Whether to run in a worker thread (the default) or on the calling thread. On the calling thread inputs are not
   * copied: they must not be modified until the call has settled.
   */
  worker?: boolean | undefined;
  /**
   * How many workers may share the work (default `"auto"`: one for each processor, but no more than four). The result is the
   * same, byte by byte. One does all of it where a second one would take more memory than `maxBytes`, or there is one processor.
   */
  workers?: 1 | 2 | 4 | "auto" | undefined;
  /**
   * Whether to transfer the buffers of the inputs to the worker instead of copying them (default `false`). The caller's
   * arrays are empty afterwards. Arrays that are views of a part of a buffer are always copied.
   */
  transfer?: boolean | undefined;
}

/** All options of the algorithm, each optional. */
export type Settings = { [K in keyof Options]?: Options[K] | undefined };

/** Options of `stitch` and `align`. */
export interface StitchOptions<O extends Output = Output>
  extends Settings, StitchInputs<O>, CallOptions {}
/** What `stitch` returns if asked for these pictures and masks only. */
export type StitchResultOf<O extends Output> = Omit<StitchResult, Exclude<Output, O>>;
/** Options of `stitchMany`. */
export interface StitchManyOptions extends Settings, ManyInputs, CallOptions {}
/** Options of `detect`, `match` and `matchImages`. */
export interface MatchOptions extends Settings, CallOptions {}
/** Options of `estimate`. */
export interface EstimateOptions extends Settings, CallOptions {}
/** Options of `warp`. */
export interface WarpOptions extends Settings, Depths, CallOptions {}
/** Options of `blend`. */
export interface BlendOptions extends Settings, CallOptions {
  /** Reference pixels whose alignment is reliable. The seam avoids all others. */
  readonly reliable?: Mask | null | undefined;
}
/** Options of `measure`. */
export interface MeasureOptions extends CallOptions {
  /** Gains of red, green and blue, such as the mosaic's. */
  readonly gains?: readonly number[] | undefined;
}
/** Options of `fill`. */
export interface FillOptions extends Settings, CallOptions {}
