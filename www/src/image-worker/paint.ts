/** Visualizations of a result, drawn off the main thread. */
import type { DepthSettings } from "../state.js";
import type { DepthMap, Size } from "./contents.js";
import { paintDepth } from "./depth-colours.js";

export interface Rgba extends Size {
  readonly data: Uint8ClampedArray<ArrayBuffer>;
}
export interface Bytes extends Size {
  readonly data: Uint8Array<ArrayBuffer>;
}

export function bitmapOf(
  { data, width, height }: Rgba,
  colorSpace: PredefinedColorSpace,
): Promise<ImageBitmap> {
  return createImageBitmap(new ImageData(data, width, height, { colorSpace }));
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
export function voidBitmap(mosaic: Rgba, mask: Bytes): Promise<ImageBitmap> {
  return tinted(mosaic, (i) => (mask.data[i] ? [240, 110, 20, 1] : null));
}

/** Draws the seam mask: 1 (target) in teal, 2 (reference) in violet, 3 (both) in amber. */
export function seamBitmap(mosaic: Rgba, seam: Bytes): Promise<ImageBitmap> {
  const tints = [null, [0, 150, 136, 0.45], [120, 80, 200, 0.45], [230, 170, 40, 0.45]] as const;
  return tinted(mosaic, (i) => tints[seam.data[i] ?? 0] ?? null);
}

/** Draws the photo that each pixel comes from, 0 for none, in its colour of `colours` (RGB one after another). */
export function labelsBitmap(
  mosaic: Rgba,
  labels: Bytes,
  colours: Uint8Array,
): Promise<ImageBitmap> {
  const { data, width, height } = mosaic;
  const out = new ImageData(width, height);
  // Such a mosaic can have tens of millions of pixels, so this is a plain loop.
  for (let i = 0, at = 0; i < labels.data.length; i++, at += 4) {
    const from = 3 * ((labels.data[i] ?? 0) - 1);
    const gray =
      0.299 * (data[at] ?? 0) + 0.587 * (data[at + 1] ?? 0) + 0.114 * (data[at + 2] ?? 0);
    for (let channel = 0; channel < 3; channel++) {
      const tint = from < 0 ? 200 : (colours[from + channel] ?? 0);
      out.data[at + channel] = 0.45 * tint + 0.55 * gray;
    }
    out.data[at + 3] = data[at + 3] ?? 0;
  }
  return createImageBitmap(out);
}

/** Draws an image in gray, with the colour and opacity that `tint` returns for each pixel, or faint where it returns none. */
export function tinted(
  { data, width, height }: Rgba,
  tint: (pixel: number) => readonly [number, number, number, number] | null,
): Promise<ImageBitmap> {
  const out = new ImageData(width, height);
  for (let i = 0; i < width * height; i++) {
    const at = 4 * i;
    const gray =
      0.299 * (data[at] ?? 0) + 0.587 * (data[at + 1] ?? 0) + 0.114 * (data[at + 2] ?? 0);
    const colour = tint(i);
    const share = colour?.[3] ?? 0;
    const under = colour ? gray : 110 + 0.4 * gray;
    for (let channel = 0; channel < 3; channel++) {
      out.data[at + channel] = share * (colour?.[channel] ?? 0) + (1 - share) * under;
    }
    out.data[at + 3] = colour && share === 1 ? 255 : (data[at + 3] ?? 0);
  }
  return createImageBitmap(out);
}
