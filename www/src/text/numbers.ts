/** Formatted numbers. Numbers and units are joined by no-break spaces. */
import type { Size } from "../image-worker/contents.js";

const space = "\u00a0";

export function percent(share: number): string {
  const value = 100 * share;
  // “0 %” and “100 %” are exact.
  if (value > 0 && value < 0.1) return `under 0.1${space}%`;
  if (value > 99.9 && value < 100) return `over 99.9${space}%`;
  const digits = value < 1 || (value > 99 && value < 100) ? 1 : 0;
  return `${value.toFixed(value === 0 ? 0 : digits)}${space}%`;
}

export function pixels(value: number): string {
  return `${Number(value.toFixed(value < 10 ? 2 : 1))}${space}px`;
}

export function decibels(value: number): string {
  return Number.isFinite(value) ? `${value.toFixed(2)}${space}dB` : value > 0 ? `∞${space}dB` : "–";
}

export function similarity(value: number): string {
  return Number.isFinite(value) ? value.toFixed(3) : "–";
}

export function milliseconds(value: number): string {
  return value < 10 ? value.toFixed(1) : value.toFixed(0);
}

export function seconds(value: number): string {
  return `${(value / 1000).toFixed(value < 10_000 ? 2 : 1)}${space}s`;
}

export function bytes(value: number): string {
  return value >= 1e9
    ? `${(value / 1e9).toFixed(1)}${space}GB`
    : `${(value / 1e6).toFixed(0)}${space}MB`;
}

export function count(value: number, one: string, many: string): string {
  return `${value} ${value === 1 ? one : many}`;
}

/** What a photo is downscaled to, and the size of its file. */
type Scaled = Size & { readonly original: Size };

export function size({ width, height }: Size): string {
  return `${width}${space}×${space}${height}`;
}

export function sizes(photo: Scaled): string {
  const { original } = photo;
  return photo.width === original.width
    ? size(original)
    : `${size(original)}, downscaled to ${size(photo)}`;
}

/** What is worth a word about a photo that was downscaled: a long one has few pixels left across. */
export function smallAfterLimit(photo: Scaled): string {
  const { width, height, original } = photo;
  const across = Math.min(width, height);
  const before = Math.min(original.width, original.height);
  return across < 0.5 * before && across < 600
    ? `Used at ${size(photo)} only, as its longer side is reduced. Choose a larger photo size under Options.`
    : "";
}
