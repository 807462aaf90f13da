/**
 * PNG (8 and 16 bit) and JPEG files to pictures and back: a wasm module of its own, loaded by the first call. For Node, and
 * for what a browser's own decoders lose (16 bit, EXIF orientation). Work is done on the calling thread.
 */
import * as check from "./check.js";
import { instance } from "./instance.js";
import { compiler } from "./load.js";
import type { ImageInput, ImageOutput, WasmSource } from "./types.js";
import * as glue from "./wasm/codecs.js";

export { StitchError, type ErrorCode, type ErrorStage } from "./errors.js";
export type { ImageInput, ImageOutput, WasmSource } from "./types.js";

/** Larger pictures are refused before they are decoded, unless the caller says otherwise. */
export const MAX_PIXELS = 100_000_000;

/** One channel as it is in the file: a depth map lacks only its `kind`, and perhaps `invalid`, to be a `DepthInput`. */
export interface DepthMap {
  data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer>;
  width: number;
  height: number;
}

/** One byte per pixel. */
export interface GrayInput {
  readonly data: Uint8Array | Uint8ClampedArray;
  readonly width: number;
  readonly height: number;
}

const codecs = instance(glue);
const compile = compiler(new URL("./wasm/codecs_bg.wasm", import.meta.url));

/** Loads the codecs ahead of the first call, from `source` if your bundler cannot find `depthstitch/codecs.wasm`. */
export async function init(source?: WasmSource): Promise<void> {
  await codecs.start(await compile(source));
}

/**
 * Decodes a PNG or JPEG, turned upright by its EXIF orientation.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function decodeImage(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<ImageOutput> {
  const file = check.bytes("bytes", bytes);
  await init();
  return codecs.call((raw) => raw.decodeImage(file, maxPixels));
}

/**
 * Decodes one channel of a PNG or JPEG, 8 or 16 bit as in the file; colour becomes luma.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function decodeDepth(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<DepthMap> {
  const file = check.bytes("bytes", bytes);
  await init();
  return codecs.call((raw) => raw.decodeDepth(file, maxPixels));
}

/** Encodes a picture as PNG, alpha kept. */
export async function encodePng(image: ImageInput): Promise<Uint8Array<ArrayBuffer>> {
  const picture = check.image("image", image);
  await init();
  return codecs.call((raw) => raw.encodePng(picture));
}

/** Encodes a mask, or another picture of one byte per pixel, as a gray PNG. */
export async function encodeGrayPng(mask: GrayInput): Promise<Uint8Array<ArrayBuffer>> {
  const picture = check.image("mask", mask);
  await init();
  return codecs.call((raw) => raw.encodeGrayPng(picture));
}

/** Encodes a picture as JPEG of quality 1 to 100, laid over black where it is transparent. */
export async function encodeJpeg(
  image: ImageInput,
  quality: number = 90,
): Promise<Uint8Array<ArrayBuffer>> {
  const picture = check.image("image", image);
  await init();
  return codecs.call((raw) => raw.encodeJpeg(picture, quality));
}
