import type { DepthMap } from "./contents.js";
import { InputFileError } from "../input-file-error.js";

export function isPfm(bytes: ArrayBuffer): boolean {
  return /^P[fF]\s/.test(text(bytes, 3));
}

/**
 * Reads a portable float map: one (`Pf`) or three (`PF`; the first is used) 32-bit floats per pixel, bottom row first. A
 * negative scale means little-endian; its magnitude is ignored.
 *
 * @throws {InputFileError}
 */
export function readPfm(bytes: ArrayBuffer, name: string): DepthMap {
  const head = /^P([fF])\s+(\d+)\s+(\d+)\s+(-?[\d.]+(?:e[+-]?\d+)?)\s/i.exec(text(bytes, 128));
  const [whole = "", kind, wide, high, scale] = head ?? [];
  const [width, height] = [Number(wide), Number(high)];
  const channels = kind === "F" ? 3 : 1;
  if (!head || !(width > 0) || !(height > 0)) {
    throw new InputFileError(`${name} has no valid PFM header.`);
  }
  if (whole.length + 4 * channels * width * height > bytes.byteLength) {
    throw new InputFileError(`${name} is truncated: it should have ${width} × ${height} values.`);
  }
  const view = new DataView(bytes, whole.length);
  const data = new Float32Array(width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const at = 4 * channels * ((height - 1 - y) * width + x);
      data[y * width + x] = view.getFloat32(at, Number(scale) < 0);
    }
  }
  return { data, width, height };
}

function text(bytes: ArrayBuffer, length: number): string {
  return String.fromCharCode(...new Uint8Array(bytes, 0, Math.min(length, bytes.byteLength)));
}
