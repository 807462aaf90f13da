/** Visualizations of a result, drawn off the main thread: of a part of a picture, at the size that it is shown in. */
import type { Bytes, DepthMap, Rect, Rgba, Size } from "./contents.js";
import type { DepthSettings } from "../state.js";
import { paintDepth } from "./depth-colours.js";

/** A part of a picture, and the size that it is shown in. */
export interface Shown {
  readonly part: Rect;
  readonly size: Size;
}

export function pictureBitmap(
  { data, width, height }: Rgba,
  { part, size }: Shown,
  colorSpace: PredefinedColorSpace,
): Promise<ImageBitmap> {
  const image = new ImageData(data, width, height, { colorSpace });
  const smaller = size.width < part.width || size.height < part.height;
  return createImageBitmap(image, part.x, part.y, part.width, part.height, {
    ...(smaller && { resizeWidth: size.width, resizeHeight: size.height, resizeQuality: "high" }),
  });
}

/** Draws a depth map in colours, at most `width` pixels wide. */
export function depthBitmap(
  map: DepthMap,
  settings: DepthSettings,
  width: number,
): Promise<ImageBitmap> {
  return createImageBitmap(paintDepth(map, settings, width));
}

/** Draws voids in orange over the mosaic in faint gray. */
export function voidBitmap(mosaic: Rgba, shown: Shown, mask: Bytes): Promise<ImageBitmap> {
  return tinted(mosaic, shown, (i) => (mask.data[i] ? [240, 110, 20, 1] : null));
}

/** Draws the seam mask: 1 (target) in teal, 2 (reference) in violet, 3 (both) in amber. */
export function seamBitmap(mosaic: Rgba, shown: Shown, seam: Bytes): Promise<ImageBitmap> {
  const tints = [null, [0, 150, 136, 0.45], [120, 80, 200, 0.45], [230, 170, 40, 0.45]] as const;
  return tinted(mosaic, shown, (i) => tints[seam.data[i] ?? 0] ?? null);
}

/** Draws the photo that each pixel comes from, 0 for none, in its colour of `colours` (RGB one after another). */
export function labelsBitmap(
  mosaic: Rgba,
  shown: Shown,
  labels: Bytes,
  colours: Uint8Array,
): Promise<ImageBitmap> {
  const tints = Array.from({ length: 256 }, (_, label) => {
    const [red = 200, green = 200, blue = 200] =
      label > 0 ? colours.subarray(3 * label - 3, 3 * label) : [];
    return [red, green, blue, 0.45] as const;
  });
  return tinted(mosaic, shown, (i) => tints[labels.data[i] ?? 0] ?? null);
}

/** Draws an image in gray, with the colour and opacity that `tint` returns for each pixel, or faint where it returns none. */
export async function tinted(
  image: Rgba,
  shown: Shown,
  tint: (pixel: number) => readonly [number, number, number, number] | null,
): Promise<ImageBitmap> {
  const { part, size } = shown;
  const out = pixelsOf(await pictureBitmap(image, shown, "srgb"));
  const { data } = out;
  const columns = Int32Array.from({ length: size.width }, (_, x) =>
    nearest(x, part.width, size.width),
  );
  for (let y = 0, at = 0; y < size.height; y++) {
    const row = (part.y + nearest(y, part.height, size.height)) * image.width + part.x;
    for (let x = 0; x < size.width; x++, at += 4) {
      const gray =
        0.299 * (data[at] ?? 0) + 0.587 * (data[at + 1] ?? 0) + 0.114 * (data[at + 2] ?? 0);
      const colour = tint(row + (columns[x] ?? 0));
      const share = colour?.[3] ?? 0;
      const under = colour ? gray : 110 + 0.4 * gray;
      for (let channel = 0; channel < 3; channel++) {
        data[at + channel] = share * (colour?.[channel] ?? 0) + (1 - share) * under;
      }
      if (colour && share === 1) data[at + 3] = 255;
    }
  }
  return createImageBitmap(out);
}

/** The pixel of `from` that is nearest to one of `to`. */
function nearest(at: number, from: number, to: number): number {
  return Math.min(from - 1, Math.floor(((at + 0.5) * from) / to));
}

/** The pixels of a bitmap, which is closed. */
function pixelsOf(bitmap: ImageBitmap): ImageData {
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error(`This browser cannot draw ${width} × ${height} pixels.`);
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, width, height);
}
