/**
 * Stitches two photos of one scene taken from two places, using depth.
 *
 * Pixel centres are whole numbers, origin top left, x right, y down. `target` moves, `reference` stays. Work is done in a
 * worker unless `worker: false`; calls wait for each other, as each needs much memory. All errors are {@link StitchError}s.
 */
import type { Call, CallName, Calls } from "./calls.js";
import * as check from "./check.js";
import { core, run } from "./core.js";
import { abortError, invalid, type StitchError } from "./errors.js";
import { runInWorker } from "./host.js";
import { compiler } from "./load.js";
import { own } from "./own.js";
import type {
  Alignment,
  BlendOptions,
  CallOptions,
  EstimateInputs,
  EstimateOptions,
  Features,
  FillOptions,
  Geometry,
  ImageInput,
  ImageMatches,
  ImageOutput,
  Mask,
  Matches,
  MatchOptions,
  Models,
  Mosaic,
  Options,
  Quality,
  Rect,
  StitchOptions,
  StitchResult,
  Warped,
  WarpOptions,
  WasmSource,
} from "./types.js";

export { StitchError, type ErrorCode, type ErrorStage } from "./errors.js";
export type * from "./types.js";

const compile = compiler(new URL("./wasm/depthstitch_bg.wasm", import.meta.url));

/**
 * Loads the core ahead of the first call. Never needed, unless your bundler cannot find the wasm file by itself: then
 * pass where it is (`depthstitch/depthstitch.wasm`) before anything else is called.
 */
export async function init(source?: WasmSource): Promise<void> {
  await compile(source);
}

/**
 * The whole way: estimate, warp, blend, fill, measure.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-few-matches`, `no-consensus`, `degenerate-geometry`,
 * `no-overlap`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function stitch(
  target: ImageInput,
  reference: ImageInput,
  options: StitchOptions = {},
): Promise<StitchResult> {
  const settings = check.settings(options);
  const inputs = check.stitchInputs(options);
  const images = [check.image("target", target), check.image("reference", reference)] as const;
  return call("stitch", [...images, inputs, settings], options);
}

/**
 * Finds SIFT features (Lowe 2004), strongest first. A photo without texture has none, which is no error.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function detect(image: ImageInput, options: MatchOptions = {}): Promise<Features> {
  return call("detect", [check.image("image", image), check.settings(options)], options);
}

/**
 * Matches the features of two photos by their descriptors: nearest neighbours, the ratio test, both ways.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function match(
  target: Features,
  reference: Features,
  options: MatchOptions = {},
): Promise<Matches> {
  const both = [check.features("target", target), check.features("reference", reference)] as const;
  return call("match", [...both, check.settings(options)], options);
}

/**
 * Finds the features of two photos and matches them.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function matchImages(
  target: ImageInput,
  reference: ImageInput,
  options: MatchOptions = {},
): Promise<ImageMatches> {
  const images = [check.image("target", target), check.image("reference", reference)] as const;
  return call("matchImages", [...images, check.settings(options)], options);
}

/**
 * Fits both models to the matches. Needs no pixels.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-few-matches`, `no-consensus`, `degenerate-geometry`,
 * `too-large`, `out-of-memory`, `aborted`.
 */
export async function estimate(
  inputs: EstimateInputs,
  options: EstimateOptions = {},
): Promise<Geometry> {
  return call("estimate", [check.estimateInputs(inputs), check.settings(options)], options);
}

/**
 * The first half of `stitch`: matches, models and the inverse depth that goes with them. Pass its result to `warp` as
 * geometry, and its depth maps as options.
 *
 * @throws {StitchError} as `stitch`.
 */
export async function align(
  target: ImageInput,
  reference: ImageInput,
  options: StitchOptions = {},
): Promise<Alignment> {
  const images = [check.image("target", target), check.image("reference", reference)] as const;
  return call("align", [...images, check.stitchInputs(options), check.settings(options)], options);
}

/**
 * Draws the target as the reference's camera would see it.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `no-overlap`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function warp(
  target: ImageInput,
  reference: ImageInput,
  geometry: Models,
  options: WarpOptions = {},
): Promise<Warped> {
  const settings = check.settings(options);
  const images = [check.image("target", target), check.image("reference", reference)] as const;
  const inputs = [check.models(geometry), check.depths(options)] as const;
  return call("warp", [...images, ...inputs, settings], options);
}

/**
 * Puts warped target and reference together.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function blend(
  warped: Warped,
  reference: ImageInput,
  options: BlendOptions = {},
): Promise<Mosaic> {
  const { trusted } = options;
  const inputs = trusted ? { trusted: check.mask("trusted", trusted) } : {};
  const images = [check.warped(warped), check.image("reference", reference)] as const;
  return call("blend", [...images, inputs, check.settings(options)], options);
}

/** The part of a picture in a rectangle, such as one of the result's `crop`. */
export function crop({ data, width, height }: ImageOutput, rect: Rect): ImageOutput {
  const { x, y } = rect;
  const inside = x >= 0 && y >= 0 && x + rect.width <= width && y + rect.height <= height;
  if (!inside || !(rect.width > 0 && rect.height > 0))
    throw invalid(`rect must lie within the picture of ${width}×${height} pixels`);
  const part = new Uint8ClampedArray(4 * rect.width * rect.height);
  for (let row = 0; row < rect.height; row++) {
    const from = 4 * ((y + row) * width + x);
    part.set(data.subarray(from, from + 4 * rect.width), 4 * rect.width * row);
  }
  return { data: part, width: rect.width, height: rect.height };
}

/**
 * Fills the mosaic's inner voids from their borders. The option `fill` plays no part: to call is to ask for it.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function fill(
  mosaic: ImageInput,
  voidMask: Mask,
  options: FillOptions = {},
): Promise<ImageOutput> {
  const images = [check.image("mosaic", mosaic), check.mask("voidMask", voidMask)] as const;
  return call("fill", [...images, check.settings(options)], options);
}

/**
 * Compares warped target and reference where they overlap.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `no-overlap`, `out-of-memory`, `aborted`.
 */
export async function measure(
  warped: Warped,
  reference: ImageInput,
  options: CallOptions = {},
): Promise<Quality> {
  return call("measure", [check.warped(warped), check.image("reference", reference)], options);
}

/** A fresh object with the default of every setting in a mode, from the core itself. */
export async function defaultOptions(mode: Options["mode"] = "default"): Promise<Options> {
  await core.start(await compile());
  return core.call((raw) => raw.defaultOptions(mode));
}

/** The version of the core. */
export async function version(): Promise<string> {
  await core.start(await compile());
  return core.call((raw) => raw.version());
}

async function call<N extends CallName>(
  name: N,
  args: Calls[N]["args"],
  options: CallOptions,
): Promise<Calls[N]["result"]> {
  const { worker = true, transfer = false, onProgress, signal } = check.callOptions(options);
  if (signal?.aborted) throw abortError(signal);
  const request = { name, args } as Call;
  if (worker) return runInWorker(own(request, transfer), compile, options);

  await core.start(await compile());
  const stopIfAborted = () => {
    if (signal?.aborted) throw abortError(signal);
  };
  stopIfAborted();
  return run(request, (progress) => {
    onProgress?.(progress);
    stopIfAborted();
  });
}
