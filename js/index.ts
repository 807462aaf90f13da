/**
 * Stitches two to thirty photos of a scene, taken from different positions, using depth.
 *
 * Pixel centres are integers, the origin is at the top left, x points right, y points down. `target` is warped onto
 * `reference`. Calls run in a worker unless `worker: false`, one at a time to limit memory. All errors are
 * {@link StitchError}s.
 */
import type { Call, CallName, Calls } from "./calls.js";
import * as check from "./check.js";
import { core, moduleOf, run, start } from "./core.js";
import { abortError, type StitchError } from "./errors.js";
import { runInWorkers } from "./host.js";
import { compiler } from "./load.js";
import { ownedCopy } from "./transfer.js";
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
  MeasureOptions,
  Models,
  Mosaic,
  Options,
  Output,
  PhotoInput,
  Quality,
  Rect,
  StitchManyOptions,
  StitchManyResult,
  StitchOptions,
  StitchResultOf,
  Warped,
  WarpOptions,
  WasmSource,
} from "./types.js";

export { StitchError, type ErrorCode, type ErrorStage } from "./errors.js";
export type * from "./types.js";

const compile = {
  core: compiler(() => new URL("./wasm/depthstitch_bg.wasm", import.meta.url)),
  many: compiler(() => new URL("./wasm/many_bg.wasm", import.meta.url)),
};

/**
 * Loads the core before the first call. This is required only if your bundler does not find the wasm file: then pass its
 * URL (`depthstitch/depthstitch.wasm`) before calling anything else.
 *
 * @param many the same for `stitchMany`, which loads another file when it is first called: `depthstitch/many.wasm`.
 * @throws {StitchError} `load-failed`.
 */
export async function init(source?: WasmSource, many?: WasmSource): Promise<void> {
  await compile.core(source);
  if (many !== undefined) await compile.many(many);
}

/**
 * Stitches two images: estimates the geometry and depth, warps, blends, fills and measures.
 *
 * @param target is warped onto the reference; an `ImageData` fits.
 * @param reference stays as it is.
 * @param options matches, depth maps, options of every stage, progress and cancellation; all may be left out.
 * @example
 * const { mosaic, report } = await stitch(target, reference);
 * context.putImageData(new ImageData(mosaic.data, mosaic.width, mosaic.height), 0, 0);
 * for (const { message } of report.warnings) console.warn(message);
 *
 * @example
 * // Of all pictures and masks the mosaic only, which saves memory.
 * const { mosaic } = await stitch(target, reference, { outputs: ["mosaic"] });
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-few-matches`, `no-consensus`, `degenerate-geometry`,
 * `no-overlap`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function stitch<O extends Output = Output>(
  target: ImageInput,
  reference: ImageInput,
  options: StitchOptions<O> = {},
): Promise<StitchResultOf<O>> {
  return call("stitch", () => stitchArguments(target, reference, options), options);
}

/**
 * Stitches two to thirty photos of a scene, taken from wherever, in any order, into the view of one of them.
 *
 * Photos that do not belong, or cannot be shown, are left out; `photos` in the result says why. Not all options of `stitch`
 * play a part: `withoutDepth`, `robustFit` and `calibration` have no effect; `guidedMatching: false` skips matching again and the
 * sharpening of matches.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `no-consensus`, `degenerate-geometry`, `too-large`, `out-of-memory`,
 * `aborted`.
 */
export async function stitchMany(
  photos: readonly PhotoInput[],
  options: StitchManyOptions = {},
): Promise<StitchManyResult> {
  return call(
    "stitchMany",
    () => [
      check.photos(photos),
      check.manyInputs(options),
      check.settings(options, "reference", "distortion", "outputDepth"),
    ],
    options,
  );
}

/**
 * Detects SIFT features (Lowe 2004), strongest first. For an image without texture the result is empty.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function detect(image: ImageInput, options: MatchOptions = {}): Promise<Features> {
  return call("detect", () => [check.image("image", image), check.settings(options)], options);
}

/**
 * Matches the features of two images by their descriptors: nearest neighbour, ratio test, cross-check.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function match(
  target: Features,
  reference: Features,
  options: MatchOptions = {},
): Promise<Matches> {
  return call(
    "match",
    () => [
      check.features("target", target),
      check.features("reference", reference),
      check.settings(options),
    ],
    options,
  );
}

/**
 * Detects the features of two images and matches them.
 *
 * @example
 * const { matches } = await matchImages(target, reference, { matchRatio: 0.8 });
 * const [xt, yt, xr, yr] = matches; // the first match, in pixels of target and reference
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function matchImages(
  target: ImageInput,
  reference: ImageInput,
  options: MatchOptions = {},
): Promise<ImageMatches> {
  return call(
    "matchImages",
    () => [
      check.image("target", target),
      check.image("reference", reference),
      check.settings(options),
    ],
    options,
  );
}

/**
 * Estimates both models from matches, without the images.
 *
 * @param inputs sizes of the images, matches, and depth maps if there are any; unless there are both a homography is fitted.
 * @example
 * const targetSize = { width: 640, height: 480 };
 * const { forward } = await estimate({ targetSize, referenceSize: targetSize, matches });
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `too-few-matches`, `no-consensus`, `degenerate-geometry`,
 * `too-large`, `out-of-memory`, `aborted`.
 */
export async function estimate(
  inputs: EstimateInputs,
  options: EstimateOptions = {},
): Promise<Geometry> {
  return call("estimate", () => [check.estimateInputs(inputs), check.settings(options)], options);
}

/**
 * The first half of `stitch`: matches, models and inverse depth. Pass the result to `warp` as geometry, and its depth
 * maps and `voidDistance` as options.
 *
 * @param target is to be warped onto the reference.
 * @param options those of `stitch`; the ones of later stages play no part.
 * @example
 * const { targetDepth, referenceDepth, voidDistance, reliable, ...geometry } = await align(target, reference);
 *
 * @throws {StitchError} as `stitch`.
 */
export async function align(
  target: ImageInput,
  reference: ImageInput,
  options: StitchOptions = {},
): Promise<Alignment> {
  return call("align", () => stitchArguments(target, reference, options), options);
}

/**
 * Renders the target as seen by the reference's camera.
 *
 * @param geometry `forward` and `reverse`: a result of `align` or `estimate`, or models of your own.
 * @param options depth maps, which a model with parallax requires, and options of the warp.
 * @example
 * const warped = await warp(target, reference, geometry, { targetDepth, referenceDepth, voidDistance });
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `no-overlap`, `too-large`, `out-of-memory`, `aborted`.
 */
export async function warp(
  target: ImageInput,
  reference: ImageInput,
  geometry: Models,
  options: WarpOptions = {},
): Promise<Warped> {
  return call(
    "warp",
    () => [
      check.image("target", target),
      check.image("reference", reference),
      check.models(geometry),
      check.depths(options),
      check.settings(options, "targetDepth", "referenceDepth"),
    ],
    options,
  );
}

/**
 * Composites warped target and reference: exposure compensation, seam, blending.
 *
 * @param warped a result of `warp` or `stitch`.
 * @param options `reliable` of `align`, so that the seam avoids what is unreliable, and options of the blending.
 * @example
 * const { mosaic, voidMask } = await blend(warped, reference, { reliable });
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function blend(
  warped: Warped,
  reference: ImageInput,
  options: BlendOptions = {},
): Promise<Mosaic> {
  return call(
    "blend",
    () => [
      check.warped(warped),
      check.image("reference", reference),
      check.blendInputs(options),
      check.settings(options, "reliable"),
    ],
    options,
  );
}

/**
 * Cuts a rectangle out of an image, for example one of those in a result's `crop`.
 *
 * @param rect in whole pixels, within the image.
 * @example
 * const { mosaic, crop: rects } = await stitch(target, reference);
 * const rectangular = rects.inner ? crop(mosaic, rects.inner) : mosaic;
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`.
 */
export function crop(image: ImageInput, rect: Rect): ImageOutput {
  const { whole, part: rectangle } = check.read(() => {
    const whole = check.wholeImage("image", image);
    return { whole, part: check.rectWithin(rect, whole) };
  });
  const { data, width } = whole;
  const { x, y, ...size } = rectangle;
  const part = new Uint8ClampedArray(4 * size.width * size.height);
  for (let row = 0; row < size.height; row++) {
    const from = 4 * ((y + row) * width + x);
    part.set(data.subarray(from, from + 4 * size.width), 4 * size.width * row);
  }
  return { data: part, ...size };
}

/**
 * Fills the voids of a mosaic as the option `fill` says: `"exemplar"` (PatchMatch; thin gaps by coherence transport) or
 * `"smooth"` (coherence transport). With `"none"` it fills as with `"exemplar"`. Unlike `stitch` it knows no depth, so
 * patches may come from the foreground.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `out-of-memory`, `aborted`.
 */
export async function fill(
  mosaic: ImageInput,
  voidMask: Mask,
  options: FillOptions = {},
): Promise<ImageOutput> {
  return call(
    "fill",
    () => [
      check.image("mosaic", mosaic),
      check.mask("voidMask", voidMask),
      check.settings(options),
    ],
    options,
  );
}

/**
 * Measures how well warped target and reference agree in the overlap, after multiplying the target's
 * linear light by the gains, if any are given.
 *
 * @throws {StitchError} `invalid-argument`, `size-mismatch`, `no-overlap`, `out-of-memory`, `aborted`.
 */
export async function measure(
  warped: Warped,
  reference: ImageInput,
  options: MeasureOptions = {},
): Promise<Quality> {
  return call(
    "measure",
    () => [check.warped(warped), check.image("reference", reference), check.gains(options)],
    options,
  );
}

/** The default values of all options in a mode. */
export async function defaultOptions(mode: Options["mode"] = "default"): Promise<Options> {
  check.read(() => check.text("mode", mode));
  await core.start(await compile.core());
  return core.call((raw) => raw.defaultOptions(mode));
}

/** The version of the core. */
export async function version(): Promise<string> {
  await core.start(await compile.core());
  return core.call((raw) => raw.version());
}

/** Checked, what `stitch` and its first half take. */
function stitchArguments(
  target: ImageInput,
  reference: ImageInput,
  options: StitchOptions,
): Calls["stitch"]["args"] {
  return [
    check.image("target", target),
    check.image("reference", reference),
    check.stitchInputs(options),
    check.settings(options, "matches", "targetDepth", "referenceDepth", "outputDepth", "outputs"),
  ];
}

/**
 * Runs a function of the core with the arguments that `read` makes of the caller's: in a worker (`worker/`), which gets a copy of
 * them or the arguments themselves, or here. Both ways end in `run` of `core.ts`, which names the function's arguments.
 */
async function call<N extends CallName>(
  name: N,
  read: () => Calls[N]["args"],
  options: CallOptions,
): Promise<Calls[N]["result"]> {
  const { worker, transfer, ...how } = check.read(() => check.callOptions(options));
  const { onProgress, signal } = how;
  const request = { name, args: check.read(read) } as Call;
  if (signal?.aborted) throw abortError(signal);
  const load = compile[moduleOf(request)];
  if (worker) return runInWorkers(ownedCopy(request, transfer), load, how);

  const module = moduleOf(request);
  await start(module, await load());
  const stopIfAborted = () => {
    if (signal?.aborted) throw abortError(signal);
  };
  stopIfAborted();
  return run(request, module, (progress) => {
    onProgress?.(progress);
    stopIfAborted();
  });
}
