/**
 * Decodes and encodes PNG (8 and 16 bit) and JPEG files, in a separate wasm module that the first call loads. Use it in
 * Node, and in browsers for 16-bit PNG, which canvases reduce to 8 bits. It runs on the calling thread.
 */
import * as check from "./check.js";
import { instance } from "./instance.js";
import { compiler } from "./load.js";
import type { ImageInput, ImageOutput, WasmSource } from "./types.js";
import * as glue from "./wasm/codecs.js";

export { StitchError, type ErrorCode, type ErrorStage } from "./errors.js";
export type { ImageInput, ImageOutput, WasmSource } from "./types.js";

/** Default limit of the number of pixels; larger images are rejected before they are decoded. */
export const MAX_PIXELS = 100_000_000;

/** One channel as stored in the file. Add `kind` (and `invalid`) to make it a `DepthInput`. */
export interface DepthMap {
  data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer>;
  width: number;
  height: number;
}

/** A grayscale image, one byte per pixel. */
export interface GrayInput {
  readonly data: Uint8Array | Uint8ClampedArray;
  readonly width: number;
  readonly height: number;
}

const codecs = instance(glue);
const compile = compiler(new URL("./wasm/codecs_bg.wasm", import.meta.url));

/** Loads the codecs before the first call, from `source` if your bundler does not find `depthstitch/codecs.wasm`. */
export async function init(source?: WasmSource): Promise<void> {
  await codecs.start(await compile(source));
}

/**
 * Decodes a PNG or JPEG and applies its EXIF orientation.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function decodeImage(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<ImageOutput> {
  const { file, most } = check.read(() => ({
    file: check.bytes("bytes", bytes),
    most: check.number("maxPixels", maxPixels),
  }));
  await init();
  return codecs.call((raw) => raw.decodeImage(file, most));
}

/**
 * Decodes a PNG or JPEG as one channel of 8 or 16 bits, as stored; colours are converted to luma.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function decodeDepth(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<DepthMap> {
  const { file, most } = check.read(() => ({
    file: check.bytes("bytes", bytes),
    most: check.number("maxPixels", maxPixels),
  }));
  await init();
  return codecs.call((raw) => raw.decodeDepth(file, most));
}

/** Encodes an image as PNG with alpha. */
export async function encodePng(image: ImageInput): Promise<Uint8Array<ArrayBuffer>> {
  const input = check.read(() => check.image("image", image));
  await init();
  return codecs.call((raw) => raw.encodePng(input));
}

/** Encodes a mask or another single-channel image as a grayscale PNG. */
export async function encodeGrayPng(mask: GrayInput): Promise<Uint8Array<ArrayBuffer>> {
  const input = check.read(() => check.image("mask", mask));
  await init();
  return codecs.call((raw) => raw.encodeGrayPng(input));
}

/** Encodes an image as JPEG with a quality from 1 to 100; transparent pixels become black. */
export async function encodeJpeg(
  image: ImageInput,
  quality: number = 90,
): Promise<Uint8Array<ArrayBuffer>> {
  const { input, share } = check.read(() => ({
    input: check.image("image", image),
    share: check.number("quality", quality),
  }));
  await init();
  return codecs.call((raw) => raw.encodeJpeg(input, share));
}
