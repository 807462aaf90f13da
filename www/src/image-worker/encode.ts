import type { Size } from "./contents.js";
import type { Rgba } from "./paint.js";

export interface Rect extends Size {
  readonly x: number;
  readonly y: number;
}

export type Format = "png" | "jpeg";

/** Encodes a part of an image: PNG with transparency, JPEG over white. */
export async function encode(image: Rgba, part: Rect, format: Format): Promise<Blob> {
  const canvas = new OffscreenCanvas(part.width, part.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error(`This browser cannot draw ${part.width} × ${part.height} pixels.`);
  const whole = new ImageData(image.data, image.width, image.height);
  context.putImageData(whole, -part.x, -part.y, part.x, part.y, part.width, part.height);
  if (format === "png") return canvas.convertToBlob({ type: "image/png" });
  context.globalCompositeOperation = "destination-over";
  context.fillStyle = "#fff";
  context.fillRect(0, 0, part.width, part.height);
  return canvas.convertToBlob({ type: "image/jpeg", quality: 0.92 });
}
