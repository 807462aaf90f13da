import { extname } from "node:path";

import { encodeJpeg, encodePng, type PhotoMetadata } from "../codecs.js";
import type { ImageOutput } from "../index.js";

/** The bytes of a picture, as its file's name says. */
export async function encodeImage(
  path: string,
  image: ImageOutput,
  quality: number,
  metadata: Partial<PhotoMetadata>,
): Promise<Uint8Array> {
  return extname(path).toLowerCase() === ".png"
    ? encodePng(image, metadata)
    : encodeJpeg(image, quality, metadata);
}

/** The bytes of a JSON file. */
export function jsonBytes(json: object): Uint8Array {
  return new TextEncoder().encode(`${JSON.stringify(json, null, 1)}\n`);
}
