import { FileError, parseNpy } from "depthstitch/cases";
import type { DepthMap } from "./contents.js";
import { InputFileError } from "../input-file-error.js";
import { maxPixels } from "./decode-photo.js";
import { isPfm, readPfm } from "./pfm.js";

/**
 * Decodes a depth map: PNG, JPEG, NumPy's `.npy`, or a portable float map. Canvases would reduce 16-bit PNG to 8 bits, so
 * images are decoded by the package's codecs, which are loaded now.
 *
 * @throws {InputFileError}
 */
export async function decodeDepth(file: Blob, name: string): Promise<DepthMap> {
  if (file.size === 0) throw new InputFileError(`${name} is empty.`);
  const bytes = await file.arrayBuffer();
  const map = isNpy(bytes)
    ? readNpy(bytes, name)
    : isPfm(bytes)
      ? readPfm(bytes, name)
      : await readImage(bytes, name);
  if (map.width * map.height > maxPixels) {
    throw new InputFileError(
      `${name} has ${map.width} × ${map.height} values; the limit of this page is ${maxPixels / 1e6} million.`,
    );
  }
  return map;
}

function isNpy(bytes: ArrayBuffer): boolean {
  const head = new Uint8Array(bytes, 0, Math.min(6, bytes.byteLength));
  return String.fromCharCode(...head) === "\x93NUMPY";
}

/** A two-dimensional array; dimensions of size 1 are ignored. */
function readNpy(bytes: ArrayBuffer, name: string): DepthMap {
  try {
    const { data, shape } = parseNpy(new Uint8Array(bytes), name);
    const [height, width, ...others] = shape.filter((side) => side !== 1);
    if (!width || !height || others.length > 0) {
      throw new InputFileError(
        `${name} is not two-dimensional: its shape is ${shape.join(" × ")}.`,
      );
    }
    return { data: Float32Array.from(data), width, height };
  } catch (error) {
    throw error instanceof FileError ? new InputFileError(`${error.message}.`) : error;
  }
}

async function readImage(bytes: ArrayBuffer, name: string): Promise<DepthMap> {
  const codecs = await import("depthstitch/codecs");
  try {
    return await codecs.decodeDepth(bytes, maxPixels);
  } catch (error) {
    const reason = error instanceof Error ? ` (${error.message})` : "";
    throw new InputFileError(
      `${name} cannot be read as a depth map${reason}. Choose a grayscale PNG of 8 or 16 bits, a .npy or .pfm file, or a JPEG.`,
    );
  }
}
