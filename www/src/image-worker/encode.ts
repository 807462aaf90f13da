import type { Rect, Rgba, Size } from "./contents.js";

export type Format = "png" | "jpeg";

const quality = 0.92;

/**
 * Encodes a part of an image: PNG with transparency, JPEG over white, with the profile of its colour space. `source` is the file of the photo
 * whose camera data are kept, changed to those of an upright image of this size.
 */
export async function encode(
  image: Rgba,
  part: Rect,
  format: Format,
  colorSpace: PredefinedColorSpace,
  source: Blob | null,
): Promise<Blob> {
  const { canvas, context } = newCanvas(part, colorSpace);
  const whole = new ImageData(image.data, image.width, image.height, { colorSpace });
  context.putImageData(whole, -part.x, -part.y, part.x, part.y, part.width, part.height);
  if (format === "jpeg") {
    context.globalCompositeOperation = "destination-over";
    context.fillStyle = "#fff";
    context.fillRect(0, 0, part.width, part.height);
  }
  const type = `image/${format}`;
  const exif = source && (await exifOf(source));
  if (!exif) return canvas.convertToBlob({ type, quality });
  // Browsers write no camera data.
  const codecs = await import("depthstitch/codecs");
  const pixels = context.getImageData(0, 0, part.width, part.height);
  const metadata = { exif, colourProfile: await profileOf(colorSpace) };
  const bytes =
    format === "png"
      ? await codecs.encodePng(pixels, metadata)
      : await codecs.encodeJpeg(pixels, 100 * quality, metadata);
  return new Blob([bytes], { type });
}

function newCanvas({ width, height }: Size, colorSpace: PredefinedColorSpace) {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true, colorSpace });
  if (!context) throw new Error(`This browser cannot draw ${width} × ${height} pixels.`);
  return { canvas, context };
}

/** The camera data of a JPEG or PNG, if any. Without them the codecs need not be loaded. */
async function exifOf(source: Blob): Promise<Uint8Array | null> {
  const bytes = await source.arrayBuffer();
  const text = new TextDecoder("latin1").decode(bytes);
  if (!/^(\xff\xd8|.PNG)/.test(text) || !/Exif\0\0|eXIf/.test(text)) return null;
  const { readMetadata } = await import("depthstitch/codecs");
  return readMetadata(bytes).then(
    ({ exif }) => exif,
    () => null,
  );
}

/** The profile that the browser itself writes for a colour space; null for sRGB, which needs none. */
async function profileOf(colorSpace: PredefinedColorSpace): Promise<Uint8Array | null> {
  if (colorSpace === "srgb") return null;
  const png = await newCanvas({ width: 1, height: 1 }, colorSpace).canvas.convertToBlob();
  const { readMetadata } = await import("depthstitch/codecs");
  return (await readMetadata(await png.arrayBuffer())).colourProfile;
}
