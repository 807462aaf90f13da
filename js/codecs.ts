/**
 * Decodes and encodes PNG (8 and 16 bit) and JPEG files, in a separate wasm module that the first call loads. Use it in
 * Node, and in browsers for 16-bit PNG, which canvases reduce to 8 bits. It runs on the calling thread,
 * where nothing can stop it: to give a file up, call it from a worker and terminate that.
 */
import * as check from "./check.js";
import { instance } from "./instance.js";
import { compiler } from "./load.js";
import type { ImageInput, ImageOutput, Size, WasmSource } from "./types.js";
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

/** What a file says of a photo besides its pixels. */
export interface PhotoMetadata {
  /** An ICC profile of RGB colours; null for sRGB. */
  readonly colourProfile: Uint8Array | null;
  /** EXIF data: a TIFF file without an image. */
  readonly exif: Uint8Array | null;
}

const codecs = instance(glue);
const compile = compiler(() => new URL("./wasm/codecs_bg.wasm", import.meta.url));

/** Loads the codecs before the first call, from `source` if your bundler does not find `depthstitch/codecs.wasm`. */
export async function init(source?: WasmSource): Promise<void> {
  await codecs.start(await compile(source));
}

/** What all that read a file are given. */
function checked(bytes: unknown, maxPixels: unknown): { file: Uint8Array; most: number } {
  return check.read(() => ({
    file: check.bytes("bytes", bytes),
    most: check.number("maxPixels", maxPixels),
  }));
}

/**
 * Decodes a PNG or JPEG and applies its EXIF orientation. Colours are those of the file: see {@link readMetadata} for their profile.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function decodeImage(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<ImageOutput> {
  const { file, most } = checked(bytes, maxPixels);
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
  const { file, most } = checked(bytes, maxPixels);
  await init();
  return codecs.call((raw) => raw.decodeDepth(file, most));
}

/**
 * Reads the colour profile and the EXIF data of a PNG or JPEG.
 *
 * @throws {StitchError} `decode-failed`, `too-large` above `maxPixels`, `out-of-memory`, `invalid-argument`.
 */
export async function readMetadata(
  bytes: Uint8Array | ArrayBuffer,
  maxPixels: number = MAX_PIXELS,
): Promise<PhotoMetadata> {
  const { file, most } = checked(bytes, maxPixels);
  await init();
  return codecs.call((raw) => raw.readMetadata(file, most));
}

/**
 * The focal length in pixels of a photo that has this size now, upright or not, from its EXIF data: from the 35 mm equivalent, or from the focal
 * length and the resolution of the sensor. Null if neither is there, and if the photo has been cropped to another shape since.
 *
 * @throws {StitchError} `out-of-memory`, `invalid-argument`.
 */
export async function readFocalLength(exif: Uint8Array, size: Size): Promise<number | null> {
  const [data, now] = check.read(() => [check.bytes("exif", exif), check.size("size", size)]);
  await init();
  return codecs.call((raw) => raw.readFocalLength(data, now));
}

/**
 * Converts an image from the colours of one ICC profile to those of another; null is sRGB. Alpha stays.
 *
 * @throws {StitchError} `decode-failed` for a profile that is damaged or not of RGB colours, `out-of-memory`, `invalid-argument`.
 */
export async function convertColours(
  image: ImageInput,
  from: Uint8Array | null,
  to: Uint8Array | null,
): Promise<ImageOutput> {
  const { input, source, target } = check.read(() => ({
    input: check.image("image", image),
    source: optionalBytes("from", from),
    target: optionalBytes("to", to),
  }));
  await init();
  return codecs.call((raw) => raw.convertColours(input, source, target));
}

/**
 * Encodes an image as PNG with alpha. `metadata` is that of the photo it was made of: the profile is that of the image's colours, the EXIF
 * data are changed to those of an upright image of its size without a thumbnail, and left out if they are damaged.
 */
export async function encodePng(
  image: ImageInput,
  metadata: Partial<PhotoMetadata> = {},
): Promise<Uint8Array<ArrayBuffer>> {
  const { input, profile, exif } = check.read(() => ({
    input: check.image("image", image),
    ...metadataBytes(metadata),
  }));
  await init();
  return codecs.call((raw) => raw.encodePng(input, profile, exif));
}

/** Encodes a mask or another single-channel image as a grayscale PNG. */
export async function encodeGrayPng(mask: GrayInput): Promise<Uint8Array<ArrayBuffer>> {
  const input = check.read(() => check.image("mask", mask));
  await init();
  return codecs.call((raw) => raw.encodeGrayPng(input));
}

/**
 * Encodes an image as JPEG with a quality from 1 to 100 (default 90); transparent pixels become black. `metadata` as for
 * {@link encodePng}; EXIF data of more than 64 KB are left out.
 */
export async function encodeJpeg(
  image: ImageInput,
  quality: number = 90,
  metadata: Partial<PhotoMetadata> = {},
): Promise<Uint8Array<ArrayBuffer>> {
  const { input, share, profile, exif } = check.read(() => ({
    input: check.image("image", image),
    share: check.number("quality", quality),
    ...metadataBytes(metadata),
  }));
  await init();
  return codecs.call((raw) => raw.encodeJpeg(input, share, profile, exif));
}

/** Bytes, or null for none. */
function optionalBytes(name: string, value: unknown): Uint8Array | null {
  return value === null || value === undefined ? null : check.bytes(name, value);
}

/** Colour profile and EXIF data of an image to be encoded. */
function metadataBytes(value: unknown): { profile: Uint8Array | null; exif: Uint8Array | null } {
  const { colourProfile, exif } = check.object("metadata", value);
  return {
    profile: optionalBytes("colourProfile", colourProfile),
    exif: optionalBytes("exif", exif),
  };
}
