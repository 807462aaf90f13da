import { FileError } from "./errors.js";

/** A numeric array of any rank in row-major order. */
export interface NumericArray {
  /** Doubles for types that floats cannot represent. */
  readonly data: Float32Array<ArrayBuffer> | Float64Array<ArrayBuffer>;
  readonly shape: readonly number[];
}

const MAGIC = [0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59]; // \x93NUMPY

/** Size in bytes and reader of each supported type. Reading through a view allows any alignment and byte order. */
const TYPES: Readonly<Record<string, { size: number; exact: boolean; read: Reader }>> = {
  f2: { size: 2, exact: true, read: (view, at, little) => half(view.getUint16(at, little)) },
  f4: { size: 4, exact: true, read: (view, at, little) => view.getFloat32(at, little) },
  f8: { size: 8, exact: false, read: (view, at, little) => view.getFloat64(at, little) },
  u1: { size: 1, exact: true, read: (view, at) => view.getUint8(at) },
  u2: { size: 2, exact: true, read: (view, at, little) => view.getUint16(at, little) },
  u4: { size: 4, exact: false, read: (view, at, little) => view.getUint32(at, little) },
  i1: { size: 1, exact: true, read: (view, at) => view.getInt8(at) },
  i2: { size: 2, exact: true, read: (view, at, little) => view.getInt16(at, little) },
  i4: { size: 4, exact: false, read: (view, at, little) => view.getInt32(at, little) },
};
type Reader = (view: DataView, at: number, little: boolean) => number;

/**
 * Reads a NumPy `.npy` file (version 1 to 3) of floats or integers of up to 32 bits, or of doubles, in C order.
 *
 * @throws {FileError} `invalid-npy`; `path` is only for its message.
 */
export function parseNpy(bytes: Uint8Array, path: string): NumericArray {
  const fail = (reason: string): never => {
    throw new FileError("invalid-npy", path, reason);
  };
  const { header, start } = splitHeader(bytes, fail);
  const descr = /'descr':\s*'([^']*)'/.exec(header)?.[1];
  const order = /'fortran_order':\s*(True|False)/.exec(header)?.[1];
  const extents = /'shape':\s*\(([\d,\s]*)\)/.exec(header)?.[1];
  if (descr === undefined || order === undefined || extents === undefined)
    return fail("has no valid header");
  const type = TYPES[descr.slice(1)];
  if (!type || !/^[<>|=]/.test(descr))
    return fail(`has the unsupported type ${descr}: floats, doubles, or integers up to 32 bits`);
  if (order === "True") fail("is in Fortran order, only C order is supported");

  const shape = extents
    .split(",")
    .filter((extent) => extent.trim() !== "")
    .map(Number);
  const count = shape.reduce((product, extent) => product * extent, 1);
  const actual = bytes.length - start;
  if (actual !== count * type.size)
    fail(`has ${actual} bytes of data, its shape implies ${count * type.size}`);

  const view = new DataView(bytes.buffer, bytes.byteOffset + start, actual);
  const data = type.exact ? new Float32Array(count) : new Float64Array(count);
  const little = !descr.startsWith(">");
  for (let i = 0; i < count; i++) data[i] = type.read(view, i * type.size, little);
  return { data, shape };
}

/** The header as text, and where the data starts. */
function splitHeader(
  bytes: Uint8Array,
  fail: (reason: string) => never,
): { readonly header: string; readonly start: number } {
  if (bytes.length < 10 || MAGIC.some((byte, i) => bytes[i] !== byte)) fail("is not an .npy file");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const major = view.getUint8(6);
  if (major < 1 || major > 3) fail(`has .npy version ${major}, only 1 to 3 are supported`);
  if (major > 1 && bytes.length < 12) fail("is truncated");
  const from = major === 1 ? 10 : 12;
  const start = from + (major === 1 ? view.getUint16(8, true) : view.getUint32(8, true));
  if (start > bytes.length) fail("is truncated");
  return { header: new TextDecoder().decode(bytes.subarray(from, start)), start };
}

/** IEEE 754 half precision. */
function half(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}
