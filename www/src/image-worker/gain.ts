/** Visualizes the exposure compensation of the first photo, from its luminance before and after. */
import type { Rgba } from "./contents.js";
import { tinted, type Shown } from "./paint.js";

/** The gain in octaves, in square cells. */
export interface GainField {
  readonly octaves: Float64Array<ArrayBuffer>;
  readonly columns: number;
  readonly rows: number;
  /** Pixels of a cell. */
  readonly side: number;
  /** The end of the colour scale, in octaves; the other end is its negative. */
  readonly range: number;
}

/** Cells along the longer side; the gain field is smoother than that. */
const cellCount = 96;
/** Levels between clipping and noise. */
const usable = (level: number) => level >= 6 && level <= 249;
/** Minimum range of the colour scale, in octaves. */
const minRange = 0.05;

const darker = [98, 64, 178];
const same = [238, 238, 232];
const brighter = [236, 150, 20];
const palette = Array.from({ length: 255 }, (_, i) => {
  const t = i / 127 - 1;
  const [r = 0, g = 0, b = 0] = same.map((from, c) => {
    const to = (t < 0 ? darker : brighter)[c] ?? 0;
    return from + Math.abs(t) * (to - from);
  });
  return [r, g, b, 0.75] as const;
});

/** A pixel of the reference with a smaller alpha is masked. */
const leastAlpha = 128;

/** sRGB's transfer function (IEC 61966-2-1). */
const linear = Float64Array.from({ length: 256 }, (_, level) => {
  const v = level / 255;
  return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
});

/**
 * The gain of the warped photo. `average` is the mosaic in which the compensated photo and the reference,
 * at `left`, `top`, are averaged in the overlap.
 */
export function gainField(
  warped: Rgba,
  average: Rgba,
  reference: Rgba,
  { x: left, y: top }: { readonly x: number; readonly y: number },
): GainField {
  const { width, height } = warped;
  const side = Math.ceil(Math.max(width, height) / cellCount);
  const columns = Math.ceil(width / side);
  const rows = Math.ceil(height / side);
  const [before, after, count] = [0, 1, 2].map(() => new Float64Array(columns * rows)) as [
    Float64Array,
    Float64Array,
    Float64Array,
  ];
  const [from, to] = [new Uint8Array(3), new Int16Array(3)];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const at = 4 * (y * width + x);
      if (!warped.data[at + 3]) continue;
      const [u, v] = [x - left, y - top];
      const there = 4 * (v * reference.width + u);
      const inside =
        u >= 0 &&
        v >= 0 &&
        u < reference.width &&
        v < reference.height &&
        (reference.data[there + 3] ?? 0) >= leastAlpha;
      for (let c = 0; c < 3; c++) {
        from[c] = warped.data[at + c] ?? 0;
        const mixed = average.data[at + c] ?? 0;
        to[c] = inside ? 2 * mixed - (reference.data[there + c] ?? 0) : mixed;
      }
      if (!from.every(usable) || !to.every(usable)) continue;
      const cell = Math.floor(y / side) * columns + Math.floor(x / side);
      before[cell] = (before[cell] ?? 0) + luminance(from);
      after[cell] = (after[cell] ?? 0) + luminance(to);
      count[cell] = (count[cell] ?? 0) + 1;
    }
  }
  const octaves = before.map((light, i) =>
    (count[i] ?? 0) * 8 >= side * side ? Math.log2((after[i] ?? 0) / light) : Number.NaN,
  );
  const range = octaves.reduce(
    (most, value) => (Math.abs(value) > most ? Math.abs(value) : most),
    minRange,
  );
  fillUnknown(octaves, columns, rows);
  return { octaves, columns, rows, side, range };
}

/** The warped photo in gray, tinted by its gain. */
export function gainBitmap(
  warped: Rgba,
  shown: Shown,
  { octaves, columns, rows, side, range }: GainField,
): Promise<ImageBitmap> {
  const { data, width } = warped;
  return tinted(warped, shown, (i) => {
    if (!data[4 * i + 3]) return null;
    const [x, y] = [(i % width) / side, Math.floor(i / width) / side];
    const value = interpolate(octaves, columns, rows, x, y);
    return palette[Math.round(127 * (1 + Math.max(-1, Math.min(1, value / range))))] ?? null;
  });
}

function luminance([red = 0, green = 0, blue = 0]: ArrayLike<number> & Iterable<number>): number {
  const light = (level: number) => linear[level] ?? 0;
  return 0.2126 * light(red) + 0.7152 * light(green) + 0.0722 * light(blue);
}

/** Fills unknown cells with the mean of their neighbours, ring by ring. */
function fillUnknown(cells: Float64Array, columns: number, rows: number): void {
  for (let round = 0; round < columns + rows; round++) {
    const known = cells.slice();
    let unknown = false;
    for (let i = 0; i < cells.length; i++) {
      if (!Number.isNaN(known[i])) continue;
      unknown = true;
      const x = i % columns;
      const around = [
        ...(x > 0 ? [i - 1] : []),
        ...(x + 1 < columns ? [i + 1] : []),
        i - columns,
        i + columns,
      ].flatMap((j) => known[j] ?? []);
      const values = around.filter((value) => !Number.isNaN(value));
      if (values.length > 0) cells[i] = values.reduce((a, b) => a + b) / values.length;
    }
    if (!unknown) return;
  }
  // All cells are unknown.
  cells.forEach((value, i) => {
    if (Number.isNaN(value)) cells[i] = 0;
  });
}

/** Bilinear interpolation between the centres of the cells. */
function interpolate(
  cells: Float64Array,
  columns: number,
  rows: number,
  x: number,
  y: number,
): number {
  const place = (at: number, count: number) => {
    const inside = Math.max(0, Math.min(count - 1, at - 0.5));
    const low = Math.min(Math.floor(inside), Math.max(0, count - 2));
    return [low, Math.min(low + 1, count - 1), inside - low] as const;
  };
  const [x0, x1, right] = place(x, columns);
  const [y0, y1, down] = place(y, rows);
  const at = (column: number, row: number) => cells[row * columns + column] ?? 0;
  const upper = at(x0, y0) + right * (at(x1, y0) - at(x0, y0));
  const lower = at(x0, y1) + right * (at(x1, y1) - at(x0, y1));
  return upper + down * (lower - upper);
}
