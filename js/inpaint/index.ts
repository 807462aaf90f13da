/**
 * Inpaints the voids of a mosaic by a network, instead of the core's `fill`. The network is downloaded on demand; images
 * are processed locally and never uploaded.
 *
 * Requires the package `onnxruntime-web`. Networks run on the calling thread: to keep a page responsive, call them from a
 * worker.
 */
import { unexpected } from "../describe.js";
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
  const { network, weights, device, cache, ...how } = check.read(() => checked(options));
  throwIfAborted(how.signal);
  const session = await openSession(weights, { ...how, device, cache });

  return {
    device,
    async inpaint(mosaic, voidMask, call = {}) {
      const { image, mask, onProgress, signal } = check.read(() => {
        const image = check.image("mosaic", mosaic);
        const mask = check.maskOf("voidMask", voidMask, image);
        return { image, mask, ...check.call(call) };
      });
      throwIfAborted(signal);
      const { width, height } = image;
      const voids = mask.data.slice();
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

function checked(options: InpainterOptions) {
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { model = "migan", device = "wasm", cache = true } = options;
  const published =
    typeof model === "string" ? NETWORKS[check.oneOf("model", model, "migan", "lama")] : undefined;
  const network = networkOf(published ?? model, options.dilation);
  const weights = options.weights ?? published?.url;
  if (weights === undefined) throw invalid("weights must be given for a network of your own");
  return {
    network,
    weights: check.weights("weights", weights),
    device: check.oneOf("device", device, "wasm", "webgpu"),
    cache: check.boolean("cache", cache),
    ...check.call(options),
    ...check.runtime(options),
  };
}

function networkOf(network: unknown, dilation: number | undefined): InpaintNetwork {
  if (typeof network !== "object" || network === null) {
    throw unexpected('model must be "migan", "lama" or an object', network);
  }
  const { input, mask, outputMax, tileSize, dilation: own } = network as InpaintNetwork;
  check.oneOf("model.input", input, "uint8", "float32");
  check.oneOf("model.mask", mask, "known", "hole");
  if (outputMax !== 1 && outputMax !== 255)
    throw unexpected("model.outputMax must be 1 or 255", outputMax);
  check.positive("model.tileSize", tileSize);
  return { input, mask, outputMax, tileSize, dilation: check.count("dilation", dilation ?? own) };
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
