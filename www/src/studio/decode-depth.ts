import { UnusableFile } from "../unusable-file.js";
import type { DepthMap } from "./contents.js";
import { maxPixels } from "./decode-photo.js";
import { isNpy, readNpy } from "./npy.js";
import { isPfm, readPfm } from "./pfm.js";

/**
 * Decodes a depth map: PNG or JPEG, NumPy's `.npy`, or a portable float map. A canvas would cut 16 bits to 8, so PNG goes
 * through the package's codecs, which are loaded now.
 *
 * @throws {UnusableFile} whose message is for the user
 */
export async function decodeDepth(file: Blob, name: string): Promise<DepthMap> {
  if (file.size === 0) throw new UnusableFile(`${name} is empty.`);
  const bytes = await file.arrayBuffer();
  const map = isNpy(bytes)
    ? readNpy(bytes, name)
    : isPfm(bytes)
      ? readPfm(bytes, name)
      : await readPicture(bytes, name);
  if (map.width * map.height > maxPixels) {
    throw new UnusableFile(
      `${name} has ${map.width} × ${map.height} values, more than the ${maxPixels / 1e6} million that this page can open.`,
    );
  }
  return map;
}

async function readPicture(bytes: ArrayBuffer, name: string): Promise<DepthMap> {
  const codecs = await import("depthstitch/codecs");
  try {
    return await codecs.decodeDepth(bytes, maxPixels);
  } catch (error) {
    const reason = error instanceof Error ? ` (${error.message})` : "";
    throw new UnusableFile(
      `${name} cannot be read as a depth map${reason}. Choose a gray PNG of 8 or 16 bits, a .npy or .pfm file, or a JPEG.`,
    );
  }
}
