import { parseMatches } from "./matches-file.js";
import type { Contents, DepthMap, SlotName } from "./state.js";
import { context2d } from "./dom.js";
import { UnusableFile } from "./unusable-file.js";

/** Above this no browser's canvas can be relied on. */
const maxPixels = 100_000_000;

/** How a file becomes what its slot holds. Each throws an {@link UnusableFile} whose message is for the user. */
export const decoders: { readonly [K in SlotName]: (file: File) => Promise<Contents[K]> } = {
  target: decodePhoto,
  reference: decodePhoto,
  targetDepth: decodeDepthMap,
  referenceDepth: decodeDepthMap,
  matches: readMatches,
};

/** The browser's own decoder knows every format that it shows, and turns a photo as its EXIF data says. */
async function decodePhoto(file: File): Promise<ImageData> {
  refuseEmpty(file);
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(file, { imageOrientation: "from-image" });
  } catch {
    throw new UnusableFile(
      `${file.name} is not a picture that this browser can read, or it is damaged. Choose a JPEG, PNG or WebP file.`,
    );
  }
  try {
    const { width, height } = bitmap;
    refuseHuge(file, width, height);
    const canvas = document.createElement("canvas");
    canvas.width = width;
    canvas.height = height;
    const context = context2d(canvas, { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, width, height);
  } finally {
    bitmap.close();
  }
}

/** A canvas would cut 16 bits to 8, so depth maps go through the package's codecs, which are loaded now. */
async function decodeDepthMap(file: File): Promise<DepthMap> {
  refuseEmpty(file);
  const { decodeDepth } = await import("depthstitch/codecs");
  try {
    return await decodeDepth(await file.arrayBuffer(), maxPixels);
  } catch (error) {
    const reason = error instanceof Error ? ` (${error.message})` : "";
    throw new UnusableFile(
      `${file.name} cannot be read as a depth map${reason}. Choose a gray PNG of 8 or 16 bits, or a JPEG.`,
    );
  }
}

async function readMatches(file: File): Promise<Float32Array> {
  refuseEmpty(file);
  if (file.type.startsWith("image/")) {
    throw new UnusableFile(
      `${file.name} is a picture. Choose a CSV file with the header xt,yt,xr,yr.`,
    );
  }
  return parseMatches(await file.text(), file.name);
}

function refuseEmpty(file: File): void {
  if (file.size === 0) throw new UnusableFile(`${file.name} is empty.`);
}

function refuseHuge(file: File, width: number, height: number): void {
  if (width * height > maxPixels) {
    throw new UnusableFile(
      `${file.name} has ${width} × ${height} pixels, more than this page can hold. Choose a smaller version of it.`,
    );
  }
}
