/**
 * Inpaints the voids of a mosaic by a network, instead of the core's `fill`. The network is downloaded on demand; images
 * are processed locally and never uploaded.
 *
 * Requires the package `onnxruntime-web`. Networks run on the calling thread: to keep a page responsive, call them from a
 * worker.
 */
import { invalid } from "../errors.js";
import { orAborted, pause, throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import { openSession } from "../models/runtime.js";
import { NETWORKS } from "./networks.js";
import { inpaintPatch } from "./patch.js";
import { type Box, countMarked, tilesAround } from "./tiles.js";
import type { Inpainter, InpainterOptions, InpaintNetwork } from "./types.js";

export { StitchError, type ErrorCode, type ErrorStage } from "../errors.js";
export type { ImageInput, ImageOutput, Mask } from "../types.js";
export type {
  ModelCallOptions,
  ModelProgress,
  RuntimeOptions,
  WasmPaths,
  Weights,
} from "../models/types.js";
export type * from "./types.js";

const names = ["model", "weights", "dilation", "device", "cache"];

/**
 * Downloads and initializes an inpainting network.
 *
 * @throws {StitchError} `invalid-argument`, `model-load-failed`, `aborted`.
 */
export async function loadInpainter(options: InpainterOptions = {}): Promise<Inpainter> {
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { model = "migan", device = "wasm", cache = true } = options;
  const published =
    typeof model === "string" ? NETWORKS[check.oneOf("model", model, "migan", "lama")] : undefined;
  const network = checked(published ?? (model as InpaintNetwork), options.dilation);
  check.oneOf("device", device, "wasm", "webgpu");
  const weights = options.weights ?? published?.url;
  if (weights === undefined) throw invalid("weights must be given for a network of your own");
  const { onProgress, signal } = check.call(options);
  const runtime = check.runtime(options);
  throwIfAborted(signal);
  const session = await openSession(check.weights("weights", weights), {
    ...runtime,
    onProgress,
    signal,
    device,
    cache,
  });

  return {
    device,
    async inpaint(mosaic, voidMask, call = {}) {
      const image = check.image("mosaic", mosaic);
      const { width, height } = image;
      const voids = check.maskOf("voidMask", voidMask, image).data.slice();
      const { onProgress, signal } = check.call(call);
      throwIfAborted(signal);
      const data = new Uint8ClampedArray(image.data);
      const hasVoid = (i: number) => voids[i] !== 0;
      const unknown = (i: number) => voids[i] !== 0 || data[4 * i + 3] === 0;
      const tiles = tilesAround(
        countMarked(hasVoid, width, height),
        countMarked(unknown, width, height),
        { x: 0, y: 0, width, height },
        network.tileSize,
      );
      for (const [done, tile] of tiles.entries()) {
        onProgress?.({ stage: "run", fraction: done / tiles.length });
        await pause();
        throwIfAborted(signal);
        const holes = cropOf(unknown, width, tile.crop);
        const inpainting = inpaintPatch(session, network, data, width, tile.crop, holes);
        const patch = await orAborted(inpainting, signal);
        paste(data, voids, width, patch, tile.crop, tile.voids);
      }
      onProgress?.({ stage: "run", fraction: 1 });
      return { data, width, height };
    },
    dispose: () => session.dispose(),
  };
}

function checked(network: InpaintNetwork, dilation: number | undefined): InpaintNetwork {
  if (typeof network !== "object" || network === null) {
    throw invalid(`model must be "migan", "lama" or an object, got ${String(network)}`);
  }
  const { input, mask, outputMax, tileSize } = network;
  check.oneOf("model.input", input, "uint8", "float32");
  check.oneOf("model.mask", mask, "known", "hole");
  if (outputMax !== 1 && outputMax !== 255)
    throw invalid(`model.outputMax must be 1 or 255, got ${String(outputMax)}`);
  check.positive("model.tileSize", tileSize);
  const pixels = check.count("dilation", dilation ?? network.dilation);
  return { input, mask, outputMax, tileSize, dilation: pixels };
}

/** The marked pixels of a box. */
function cropOf(marked: (index: number) => boolean, stride: number, box: Box): Uint8Array {
  const { x, y, width, height } = box;
  const out = new Uint8Array(width * height);
  for (let i = 0; i < out.length; i++) {
    const row = y + Math.floor(i / width);
    out[i] = marked(row * stride + x + (i % width)) ? 1 : 0;
  }
  return out;
}

/** Copies the void pixels of a patch into the image. They count as known for the tiles that follow. */
function paste(
  data: Uint8ClampedArray,
  voids: Uint8Array,
  stride: number,
  patch: Float32Array,
  crop: Box,
  box: Box,
): void {
  const area = crop.width * crop.height;
  for (let y = box.y; y < box.y + box.height; y++) {
    for (let x = box.x; x < box.x + box.width; x++) {
      const to = y * stride + x;
      if (voids[to] === 0) continue;
      const from = (y - crop.y) * crop.width + x - crop.x;
      for (let c = 0; c < 3; c++) data[4 * to + c] = patch[c * area + from] ?? 0;
      data[4 * to + 3] = 255;
      voids[to] = 0;
    }
  }
}
