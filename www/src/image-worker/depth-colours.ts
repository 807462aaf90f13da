import type { DepthMap } from "./contents.js";
import type { DepthSettings } from "../state.js";

/** Nine colours of viridis, far to near, a perceptually uniform colour map. */
const anchors: readonly (readonly [number, number, number])[] = [
  [68, 1, 84],
  [71, 44, 122],
  [59, 81, 139],
  [44, 113, 142],
  [33, 144, 141],
  [39, 173, 129],
  [92, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];

/** 256 RGB colours, from far (0) to near (255). */
export const colours: Uint8Array = interpolate(256);

function interpolate(count: number): Uint8Array {
  const out = new Uint8Array(3 * count);
  for (let i = 0; i < count; i++) {
    const position = (i / (count - 1)) * (anchors.length - 1);
    const low = Math.min(Math.floor(position), anchors.length - 2);
    const share = position - low;
    for (let channel = 0; channel < 3; channel++) {
      const from = anchors[low]?.[channel] ?? 0;
      const to = anchors[low + 1]?.[channel] ?? 0;
      out[3 * i + channel] = Math.round(from + share * (to - from));
    }
  }
  return out;
}

/** Inverse depth of a value; NaN if unknown. */
function toInverseDepth(value: number, { kind, invalid }: DepthSettings): number {
  if (!Number.isFinite(value) || value === invalid) return Number.NaN;
  if (kind === "inverse") return value;
  return value > 0 ? 1 / value : Number.NaN;
}

/** The range of inverse depth that the colours cover: from the 1st to the 99th percentile. */
function range(map: DepthMap, settings: DepthSettings): readonly [number, number] {
  const step = Math.max(1, Math.floor(map.data.length / 40_000));
  const known: number[] = [];
  for (let i = 0; i < map.data.length; i += step) {
    const near = toInverseDepth(map.data[i] ?? Number.NaN, settings);
    if (!Number.isNaN(near)) known.push(near);
  }
  known.sort((a, b) => a - b);
  const at = (share: number) => known[Math.round(share * (known.length - 1))] ?? 0;
  return [at(0.01), at(0.99)];
}

/** Fraction of unknown values, 0 to 1. */
export function holeShare(map: DepthMap, settings: DepthSettings): number {
  let holes = 0;
  for (const value of map.data) if (Number.isNaN(toInverseDepth(value, settings))) holes++;
  return holes / map.data.length;
}

/** Draws a depth map in colours, at most `width` pixels wide, with unknown values hatched. */
export function paintDepth(map: DepthMap, settings: DepthSettings, width: number): ImageData {
  const scale = Math.max(1, map.width / width);
  const out = new ImageData(
    Math.max(1, Math.round(map.width / scale)),
    Math.max(1, Math.round(map.height / scale)),
  );
  const [far, near] = range(map, settings);
  const gain = 255 / (near - far || 1);
  const { data } = out;
  for (let y = 0; y < out.height; y++) {
    const row = Math.min(map.height - 1, Math.floor((y + 0.5) * scale)) * map.width;
    for (let x = 0; x < out.width; x++) {
      const value = map.data[row + Math.min(map.width - 1, Math.floor((x + 0.5) * scale))];
      const at = 4 * (y * out.width + x);
      const d = toInverseDepth(value ?? Number.NaN, settings);
      if (Number.isNaN(d)) {
        hatch(data, at, x, y);
      } else {
        const index = 3 * Math.min(255, Math.max(0, Math.round((d - far) * gain)));
        // A view of each colour would take two to five times as long.
        for (let channel = 0; channel < 3; channel++) {
          data[at + channel] = colours[index + channel] ?? 0;
        }
        data[at + 3] = 255;
      }
    }
  }
  return out;
}

/** One pixel of diagonal stripes. */
function hatch(data: Uint8ClampedArray, at: number, x: number, y: number): void {
  const gray = (x + y) % 8 < 3 ? 225 : 120;
  data.fill(gray, at, at + 3);
  data[at + 3] = 255;
}

export function paintColourLegend(width: number): ImageData {
  const out = new ImageData(width, 1);
  for (let x = 0; x < width; x++) {
    const index = 3 * Math.round((255 * x) / (width - 1));
    out.data.set(colours.subarray(index, index + 3), 4 * x);
    out.data[4 * x + 3] = 255;
  }
  return out;
}

export function paintHoleLegend(width: number, height: number): ImageData {
  const out = new ImageData(width, height);
  for (let i = 0; i < width * height; i++) hatch(out.data, 4 * i, i % width, Math.floor(i / width));
  return out;
}
