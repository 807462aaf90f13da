import type { Photo, Rgba, Size } from "./contents.js";
import { InputFileError } from "../input-file-error.js";
import { colourSpaceOf } from "./colour-space.js";
import { hold } from "./held.js";
import { headerBytes, readHeader } from "./photo-header.js";
import { isTruncated } from "./truncated.js";

/** Larger canvases are not supported by all browsers. */
export const maxPixels = 120_000_000;
/** Twice the width of the widest card, for high-density screens. */
const previewSide = 640;
/** Tags of EXIF. */
const pixelXDimension = 0xa002;
const pixelYDimension = 0xa003;
const focalLengthIn35mm = 0xa405;

/**
 * Decodes a photo with its orientation applied, downscaled to at most `limit` pixels on the longer side (0: no limit), turned clockwise by
 * 90° as often as `turns` says, and in the colour space of its file unless another one is given. The decoder of the browser supports every
 * format that the browser can show.
 *
 * @throws {InputFileError}
 */
export async function decodePhoto(
  file: Blob,
  name: string,
  limit: number,
  turns = 0,
  colours: PredefinedColorSpace | null = null,
): Promise<Photo> {
  if (file.size === 0) throw new InputFileError(`${name} is empty.`);
  const head = await file.slice(0, headerBytes).arrayBuffer();
  const header = readHeader(head);
  if (header.size) checkSize(name, header.size.width, header.size.height);
  if (isTruncated(new Uint8Array(await file.arrayBuffer()))) {
    throw new InputFileError(
      `${name} is damaged: it ends before its picture does. Choose the whole file.`,
    );
  }
  const bitmap = await decode(file, name, header.format);
  try {
    const { width, height } = bitmap;
    checkSize(name, width, height);
    const longer = Math.max(width, height);
    const colourSpace = colours ?? (await colourSpaceOf(head));
    const scale = limit > 0 ? limit / longer : 1;
    const image = pixelsOf(bitmap, scale, turns, colourSpace);
    const again = async () => {
      const bitmap = await decode(file, name, header.format);
      try {
        return pixelsOf(bitmap, scale, turns, colourSpace);
      } finally {
        bitmap.close();
      }
    };
    const preview = draw(bitmap, previewSide / longer, turns, "srgb").canvas;
    return {
      pixels: hold(image, again),
      width: image.width,
      height: image.height,
      colourSpace,
      turns,
      original: turns % 2 === 1 ? { width: height, height: width } : { width, height },
      focalLength35: header.format === "jpeg" ? await readFocalLength(head, image) : null,
      preview: preview.transferToImageBitmap(),
      fingerprint: fingerprint(image),
    };
  } finally {
    bitmap.close();
  }
}

async function decode(file: Blob, name: string, format: string): Promise<ImageBitmap> {
  try {
    return await createImageBitmap(file, { imageOrientation: "from-image" });
  } catch {
    throw new InputFileError(
      format === "heic"
        ? `${name} is a HEIC photo, which this browser cannot read. Save it as JPEG, or set the camera to “Most compatible”, and choose it again.`
        : `${name} is not an image that this browser can read, or it is damaged. Choose a JPEG, PNG or WebP file.`,
    );
  }
}

function pixelsOf(
  bitmap: ImageBitmap,
  scale: number,
  turns: number,
  colourSpace: PredefinedColorSpace,
): Rgba {
  const { canvas, context } = draw(bitmap, scale, turns, colourSpace);
  const { data, width, height } = context.getImageData(0, 0, canvas.width, canvas.height);
  // Frees its pixels now rather than when garbage is collected.
  canvas.width = canvas.height = 0;
  return { data, width, height };
}

/** Two independent sums of 32 bits (FNV-1a and a polynomial) over all pixels. */
function fingerprint({ data, width, height }: Rgba): string {
  const pixels = new Uint32Array(data.buffer, data.byteOffset, data.length >> 2);
  let [a, b] = [0x811c9dc5, width];
  for (const pixel of pixels) {
    a = Math.imul(a ^ pixel, 0x01000193);
    b = (Math.imul(b, 31) + pixel) | 0;
  }
  return `${width}x${height} ${a} ${b}`;
}

/** Draws a photo downscaled, if `scale` is below 1, and turned. */
function draw(bitmap: ImageBitmap, scale: number, turns: number, colorSpace: PredefinedColorSpace) {
  const scaled = (side: number) => Math.max(1, Math.round(side * Math.min(1, scale)));
  const [width, height] = [scaled(bitmap.width), scaled(bitmap.height)];
  const canvas =
    turns % 2 === 1 ? new OffscreenCanvas(height, width) : new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true, colorSpace });
  if (!context) throw new InputFileError("The browser has not enough memory for this photo.");
  // Whole numbers, so that pixels fall on pixels.
  if (turns === 1) context.setTransform(0, 1, -1, 0, height, 0);
  else if (turns === 2) context.setTransform(-1, 0, 0, -1, width, height);
  else if (turns === 3) context.setTransform(0, -1, 1, 0, 0, width);
  context.imageSmoothingQuality = "high";
  context.drawImage(bitmap, 0, 0, width, height);
  return { canvas, context };
}

function checkSize(name: string, width: number, height: number): void {
  if (width * height <= maxPixels) return;
  throw new InputFileError(
    `${name} has ${width} × ${height} pixels; the limit of this page is ${maxPixels / 1e6} million. Choose a smaller version.`,
  );
}

/**
 * The 35 mm equivalent of a photo that was not cropped to another shape. The EXIF reader is loaded with the first JPEG. Missing or damaged EXIF data
 * is not an error.
 */
async function readFocalLength(head: ArrayBuffer, now: Size): Promise<number | null> {
  try {
    const { parse } = await import("exifr/dist/mini.esm.mjs");
    const exif = [pixelXDimension, pixelYDimension, focalLengthIn35mm];
    const tags = await parse(head, { tiff: true, exif, translateKeys: false });
    const [width, height, value] = exif.map((tag) => tags?.[tag]);
    if (
      typeof width === "number" &&
      typeof height === "number" &&
      isCropped({ width, height }, now)
    )
      return null;
    return typeof value === "number" && value > 4 && value < 2000 ? value : null;
  } catch {
    return null;
  }
}

/** Whether the sides have another ratio than they had. Some cameras leave the sides out, as 0. */
function isCropped(taken: Size, now: Size): boolean {
  const ratio = ({ width, height }: Size) => Math.max(width, height) / Math.min(width, height);
  return Math.abs(ratio(taken) / ratio(now) - 1) > 0.02;
}
