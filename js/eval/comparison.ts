/** How well a picture, as far as it is valid, shows what another one does. */
import { denseFlow } from "./flow/index.js";
import { at, luma, plane, type Plane } from "./flow/plane.js";
import type { ErrorSummary } from "./measures.js";
import { median, percentile } from "./statistics.js";

/** Fewer valid pixels say nothing. */
const FEW = 500;
/** Fewer pixels with texture, and all valid ones count. */
const FEW_TEXTURED = 300;
/** Where the mean magnitude of the Laplacian is larger, there is texture: elsewhere a flow is unreliable. */
const TEXTURE = 4;
const TEXTURE_SIGMA = 4;
/** Side of the window of SSIM. */
const WINDOW = 7;

interface Picture {
  readonly data: Uint8ClampedArray;
  readonly width: number;
  readonly height: number;
}

export interface Comparison {
  /** PSNR in dB over valid pixels. */
  readonly psnr: number;
  /** SSIM of gray levels in uniform windows of 7×7 pixels, over the windows that are wholly valid. */
  readonly ssim: number;
  /** By how many pixels it is displaced, by dense optical flow where there is texture. */
  readonly shift: ErrorSummary;
  /** Share of the pixels that are valid. */
  readonly share: number;
}

/**
 * Compares `picture`, valid where its alpha is not 0, with `truth`, once each of its channels has been multiplied so
 * that the means agree. Undefined when hardly any pixel is valid.
 */
export function compare(picture: Picture, truth: Picture): Comparison | undefined {
  const pixels = picture.width * picture.height;
  const valid = Uint8Array.from({ length: pixels }, (_, i) =>
    picture.data[4 * i + 3] === 0 ? 0 : 1,
  );
  const count = valid.reduce((sum, one) => sum + one, 0);
  if (count < FEW) return undefined;
  const adjusted = withMeansOf(picture, truth, valid);
  let squares = 0;
  for (let i = 0; i < 4 * pixels; i++) {
    if (i % 4 !== 3) squares += ((adjusted[i] as number) - (truth.data[i] as number)) ** 2;
  }
  const error = squares / (3 * count);
  const size = { width: picture.width, height: picture.height };
  const shown = luma({ data: adjusted.map(Math.floor), ...size });
  const wanted = luma(truth);
  return {
    psnr: 10 * Math.log10(255 ** 2 / Math.max(error, 1e-9)),
    ssim: similarity(shown, wanted, valid),
    shift: displacement(wanted, shown, valid),
    share: count / pixels,
  };
}

/** The picture with its exposure made the truth's, and the truth where it is not valid. */
function withMeansOf(picture: Picture, truth: Picture, valid: Uint8Array): Float64Array {
  const [own, wanted] = [new Float64Array(4), new Float64Array(4)];
  for (let i = 0; i < picture.data.length; i++) {
    if (!valid[i >> 2]) continue;
    own[i % 4] = (own[i % 4] as number) + (picture.data[i] as number);
    wanted[i % 4] = (wanted[i % 4] as number) + (truth.data[i] as number);
  }
  const count = valid.reduce((sum, one) => sum + one, 0);
  const gains = own.map((sum, c) => (wanted[c] as number) / Math.max(sum, count));
  return Float64Array.from(picture.data, (value, i) =>
    valid[i >> 2] ? Math.min(255, value * (gains[i % 4] as number)) : (truth.data[i] as number),
  );
}

/** Z. Wang et al., *Image Quality Assessment*, IEEE TIP 13 (2004), with uniform windows and sample covariance. */
function similarity(a: Plane, b: Plane, valid: Uint8Array): number {
  const { width, height } = a;
  const [c1, c2] = [(0.01 * 255) ** 2, (0.03 * 255) ** 2];
  const n = WINDOW * WINDOW;
  const reach = WINDOW >> 1;
  let [whole, wholes, any, anys] = [0, 0, 0, 0];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      if (!valid[y * width + x]) continue;
      let [sa, sb, aa, bb, ab, all] = [0, 0, 0, 0, 0, 1];
      for (let v = y - reach; v <= y + reach; v++) {
        for (let u = x - reach; u <= x + reach; u++) {
          const i = mirrored(v, height) * width + mirrored(u, width);
          const [p, q] = [a.data[i] as number, b.data[i] as number];
          sa += p;
          sb += q;
          aa += p * p;
          bb += q * q;
          ab += p * q;
          if (u >= 0 && v >= 0 && u < width && v < height && !valid[i]) all = 0;
        }
      }
      const [ma, mb] = [sa / n, sb / n];
      const [va, vb, cov] = [aa - n * ma * ma, bb - n * mb * mb, ab - n * ma * mb].map(
        (sum) => sum / (n - 1),
      ) as [number, number, number];
      const s = ((2 * ma * mb + c1) * (2 * cov + c2)) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
      [any, anys] = [any + s, anys + 1];
      [whole, wholes] = [whole + all * s, wholes + all];
    }
  }
  return wholes > 0 ? whole / wholes : any / anys;
}

/** d c b a | a b c d | d c b a */
function mirrored(i: number, length: number): number {
  const inside = i < 0 ? -1 - i : i >= length ? 2 * length - 1 - i : i;
  return Math.min(Math.max(inside, 0), length - 1);
}

function displacement(wanted: Plane, shown: Plane, valid: Uint8Array): ErrorSummary {
  const { u, v } = denseFlow(wanted, shown);
  const lengths = u.data.map((x, i) => Math.hypot(x, v.data[i] as number));
  const texture = smoothed(laplacian(wanted));
  const textured = lengths.filter((_, i) => valid[i] && (texture.data[i] as number) > TEXTURE);
  const counted = textured.length > FEW_TEXTURED ? textured : lengths.filter((_, i) => valid[i]);
  return [median(counted), percentile(counted, 90)];
}

/** The magnitude of the Laplacian. */
function laplacian(picture: Plane): Plane {
  const { width, height } = picture;
  const out = plane(width, height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      // Mirrored at the outermost pixels.
      const value = (dx: number, dy: number): number => {
        const [column, row] = [x + dx, y + dy];
        const inside = column >= 0 && row >= 0 && column < width && row < height;
        return inside ? at(picture, column, row) : at(picture, x - dx, y - dy);
      };
      const sum = value(-1, 0) + value(1, 0) + value(0, -1) + value(0, 1) - 4 * value(0, 0);
      out.data[y * width + x] = Math.abs(sum);
    }
  }
  return out;
}

/** A Gaussian of deviation {@link TEXTURE_SIGMA}. */
function smoothed(picture: Plane): Plane {
  const reach = 4 * TEXTURE_SIGMA;
  const weights = Array.from({ length: 2 * reach + 1 }, (_, i) =>
    Math.exp(-((i - reach) ** 2) / (2 * TEXTURE_SIGMA ** 2)),
  );
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  const { width, height } = picture;
  let from = picture;
  for (const [dx, dy] of [
    [1, 0],
    [0, 1],
  ] as const) {
    const out = plane(width, height);
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        let sum = 0;
        weights.forEach((weight, i) => {
          sum += weight * at(from, x + (i - reach) * dx, y + (i - reach) * dy);
        });
        out.data[y * width + x] = sum / total;
      }
    }
    from = out;
  }
  return from;
}
