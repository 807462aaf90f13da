import { UnusableFile } from "../unusable-file.js";
import type { DepthMap } from "./contents.js";

export function isNpy(bytes: ArrayBuffer): boolean {
  const head = new Uint8Array(bytes, 0, Math.min(6, bytes.byteLength));
  return String.fromCharCode(...head) === "\x93NUMPY";
}

/** How values of each NumPy type are read; the larger ones become 32-bit floats. */
const readers: Readonly<Record<string, { size: number; read: Reader }>> = {
  f2: { size: 2, read: (view, at, little) => half(view.getUint16(at, little)) },
  f4: { size: 4, read: (view, at, little) => view.getFloat32(at, little) },
  f8: { size: 8, read: (view, at, little) => view.getFloat64(at, little) },
  u1: { size: 1, read: (view, at) => view.getUint8(at) },
  u2: { size: 2, read: (view, at, little) => view.getUint16(at, little) },
  u4: { size: 4, read: (view, at, little) => view.getUint32(at, little) },
  i2: { size: 2, read: (view, at, little) => view.getInt16(at, little) },
  i4: { size: 4, read: (view, at, little) => view.getInt32(at, little) },
};
type Reader = (view: DataView, at: number, little: boolean) => number;

/**
 * A two-dimensional array in NumPy's own format (version 1 to 3), rows first; further dimensions of length 1 do not count.
 *
 * @throws {UnusableFile}
 */
export function readNpy(bytes: ArrayBuffer, name: string): DepthMap {
  const view = new DataView(bytes);
  const wide = bytes.byteLength > 12 && view.getUint8(6) > 1;
  const start = wide ? 12 : 10;
  const length =
    bytes.byteLength < start ? 0 : wide ? view.getUint32(8, true) : view.getUint16(8, true);
  const header = new TextDecoder().decode(bytes.slice(start, start + length));
  const [, order = "", type = ""] = /'descr': *'([<>|=])(\w+)'/.exec(header) ?? [];
  const shape = (/'shape': *\(([^)]*)\)/.exec(header)?.[1] ?? "")
    .split(",")
    .flatMap((part) => (/^\s*\d+\s*$/.test(part) ? [Number(part)] : []))
    .filter((side) => side !== 1);
  const reader = readers[type];
  const [height, width] = shape;
  if (!reader || shape.length !== 2 || !width || !height || /'fortran_order': *True/.test(header)) {
    throw new UnusableFile(
      `${name} holds no array of two dimensions and plain numbers in row order; it says ${header.trim() || "nothing"}.`,
    );
  }
  if (start + length + width * height * reader.size > bytes.byteLength) {
    throw new UnusableFile(`${name} ends early: it should hold ${width} × ${height} values.`);
  }
  const data = new Float32Array(width * height);
  for (let i = 0; i < data.length; i++) {
    data[i] = reader.read(view, start + length + i * reader.size, order !== ">");
  }
  return { data, width, height };
}

/** IEEE 754 half precision. */
function half(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction ? Number.NaN : sign * Infinity;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}
