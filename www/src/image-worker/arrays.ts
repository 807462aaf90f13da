/** What is asked of large arrays. */
import type { Bytes, DepthMap } from "./contents.js";

/** How many pixels of a mask are set: 255 rather than 0. */
export function countSet({ data }: Bytes): number {
  let count = 0;
  for (const value of data) count += value & 1;
  return count;
}

/** Whether any pixel has this value. */
export function includes({ data }: Bytes, value: number): boolean {
  return data.includes(value);
}

/** The values of a map at pixels: x, y of each. */
export function valuesAt(
  { data, width }: DepthMap,
  pixels: Float64Array,
): Float64Array<ArrayBuffer> {
  return Float64Array.from({ length: pixels.length / 2 }, (_, i) => {
    const [x = 0, y = 0] = pixels.subarray(2 * i, 2 * i + 2);
    return data[Math.round(y) * width + Math.round(x)] ?? Number.NaN;
  });
}
