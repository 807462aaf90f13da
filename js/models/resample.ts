/** Samples on a grid with arbitrary strides. */
export interface Raster {
  readonly data: ArrayLike<number>;
  readonly width: number;
  readonly height: number;
  readonly channels: number;
  /** Strides in `data` between neighbouring pixels of a row, and between channels. */
  readonly pixel: number;
  readonly channel: number;
}

/** The RGB channels of an RGBA image. */
export function colours(image: { data: ArrayLike<number>; width: number; height: number }): Raster {
  const { data, width, height } = image;
  return { data, width, height, channels: 3, pixel: 4, channel: 1 };
}

/** A planar image, as networks use. */
export function planes(
  data: ArrayLike<number>,
  width: number,
  height: number,
  channels: number,
): Raster {
  return { data, width, height, channels, pixel: 1, channel: width * height };
}

/**
 * Resamples to `width`×`height` with a triangle filter: bilinear when upsampling, and with a support scaled to the
 * sampling step when downsampling, to avoid aliasing. The outer corners of both grids coincide.
 */
export function resample(source: Raster, width: number, height: number): Float32Array {
  const { data, channels, pixel, channel } = source;
  const across = taps(source.width, width);
  const down = taps(source.height, height);
  const out = new Float32Array(channels * width * height);
  const rows = new Float32Array(width * source.height);
  for (let c = 0; c < channels; c++) {
    for (let y = 0; y < source.height; y++) {
      const row = c * channel + y * source.width * pixel;
      for (let x = 0; x < width; x++) {
        const { first, weights } = across[x] as Tap;
        let sum = 0;
        for (let k = 0; k < weights.length; k++)
          sum += (weights[k] as number) * (data[row + (first + k) * pixel] as number);
        rows[y * width + x] = sum;
      }
    }
    for (let y = 0; y < height; y++) {
      const { first, weights } = down[y] as Tap;
      const row = (c * height + y) * width;
      for (let k = 0; k < weights.length; k++) {
        const weight = weights[k] as number;
        const from = (first + k) * width;
        for (let x = 0; x < width; x++)
          out[row + x] = (out[row + x] as number) + weight * (rows[from + x] as number);
      }
    }
  }
  return out;
}

/** The weights of the source samples of one output sample, starting at `first`. */
interface Tap {
  first: number;
  weights: Float64Array;
}

function taps(from: number, to: number): Tap[] {
  const step = from / to;
  const radius = Math.max(1, step);
  return Array.from({ length: to }, (_, i) => {
    const centre = (i + 0.5) * step - 0.5;
    const first = Math.max(0, Math.floor(centre - radius) + 1);
    const end = Math.min(from, Math.ceil(centre + radius));
    const weights = Float64Array.from(
      { length: end - first },
      (_, k) => 1 - Math.abs(first + k - centre) / radius,
    );
    const sum = weights.reduce((a, b) => a + b, 0);
    return { first, weights: weights.map((weight) => weight / sum) };
  });
}
