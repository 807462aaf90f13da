import { FileError } from "./errors.js";

/** A numeric array of any rank, row by row (C order). */
export interface NumericArray {
  readonly data: Float32Array | Float64Array;
  readonly shape: readonly number[];
}

const MAGIC = [0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59]; // \x93NUMPY

/**
 * Reads a NumPy `.npy` file (format 1 to 3) of little-endian float32 or float64 in C order.
 *
 * @throws FileError `invalid-npy` for anything else.
 */
export function parseNpy(bytes: Uint8Array, path: string): NumericArray {
  const fail = (reason: string): never => {
    throw new FileError("invalid-npy", path, reason);
  };
  if (bytes.length < 10 || MAGIC.some((byte, i) => bytes[i] !== byte)) fail("is no .npy file");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const major = view.getUint8(6);
  if (major < 1 || major > 3) fail(`has .npy version ${major}, 1 to 3 are read`);
  if (major > 1 && bytes.length < 12) fail("is cut short");
  const headerStart = major === 1 ? 10 : 12;
  const dataStart = headerStart + (major === 1 ? view.getUint16(8, true) : view.getUint32(8, true));
  if (dataStart > bytes.length) fail("is cut short");

  const header = new TextDecoder().decode(bytes.subarray(headerStart, dataStart));
  const descr = /'descr':\s*'([^']*)'/.exec(header)?.[1];
  const order = /'fortran_order':\s*(True|False)/.exec(header)?.[1];
  const extents = /'shape':\s*\(([\d,\s]*)\)/.exec(header)?.[1];
  if (descr === undefined || order === undefined || extents === undefined)
    return fail("has no readable header");
  if (descr !== "<f4" && descr !== "<f8") fail(`holds ${descr}, only <f4 and <f8 are read`);
  if (order === "True") fail("is in Fortran order, only C order is read");

  const shape = extents
    .split(",")
    .filter((extent) => extent.trim() !== "")
    .map(Number);
  const count = shape.reduce((product, extent) => product * extent, 1);
  const size = descr === "<f4" ? 4 : 8;
  const actual = bytes.length - dataStart;
  if (actual !== count * size)
    fail(`has ${actual} bytes of data where its shape asks for ${count * size}`);

  // Element by element through the view: right on any byte order, and the data need not be aligned.
  const data = size === 4 ? new Float32Array(count) : new Float64Array(count);
  for (let i = 0; i < count; i++) {
    const at = dataStart + i * size;
    data[i] = size === 4 ? view.getFloat32(at, true) : view.getFloat64(at, true);
  }
  return { data, shape };
}
