/**
 * Interpolates unknown pixels smoothly from known ones by the push–pull algorithm (Gortler et al. 1996): known pixels are
 * averaged over blocks of increasing size, then each unknown pixel is interpolated from the next coarser level. This hides
 * the edges of holes from the network and keeps black from being resampled into known pixels.
 *
 * @param planes three planes of `width`×`height`, changed in place
 */
export function prefill(
  planes: Float32Array,
  unknown: Uint8Array,
  width: number,
  height: number,
): void {
  if (width === 1 && height === 1) return;
  const [w, h] = [Math.ceil(width / 2), Math.ceil(height / 2)];
  const coarse = new Float32Array(3 * w * h);
  const counts = new Float32Array(w * h);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const from = y * width + x;
      if (unknown[from]) continue;
      const to = (y >> 1) * w + (x >> 1);
      counts[to] = (counts[to] ?? 0) + 1;
      for (let c = 0; c < 3; c++) {
        const i = c * w * h + to;
        coarse[i] = (coarse[i] ?? 0) + (planes[c * width * height + from] ?? 0);
      }
    }
  }
  const empty = new Uint8Array(w * h);
  for (let i = 0; i < w * h; i++) {
    const count = counts[i] ?? 0;
    empty[i] = count === 0 ? 1 : 0;
    for (let c = 0; c < 3 && count > 0; c++)
      coarse[c * w * h + i] = (coarse[c * w * h + i] ?? 0) / count;
  }
  prefill(coarse, empty, w, h);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const to = y * width + x;
      if (!unknown[to]) continue;
      // Bilinear between the four nearest blocks.
      const [x0, y0] = [x >> 1, y >> 1];
      const x1 = Math.max(0, Math.min(w - 1, x0 + (x & 1 ? 1 : -1)));
      const y1 = Math.max(0, Math.min(h - 1, y0 + (y & 1 ? 1 : -1)));
      for (let c = 0; c < 3; c++) {
        const at = (i: number, j: number) => coarse[c * w * h + j * w + i] ?? 0;
        planes[c * width * height + to] =
          (9 * at(x0, y0) + 3 * at(x1, y0) + 3 * at(x0, y1) + at(x1, y1)) / 16;
      }
    }
  }
}

/** Dilates a mask by a square of side 2 · `radius` + 1. */
export function dilate(
  marked: Uint8Array,
  width: number,
  height: number,
  radius: number,
): Uint8Array {
  const rows = dilateLines(marked, width, height, 1, width, radius);
  return dilateLines(rows, height, width, width, 1, radius);
}

/** Dilates along one direction: `lines` of `length` pixels, `step` apart. */
function dilateLines(
  marked: Uint8Array,
  length: number,
  lines: number,
  step: number,
  line: number,
  radius: number,
): Uint8Array {
  const out = new Uint8Array(marked.length);
  for (let k = 0; k < lines; k++) {
    let reach = -1;
    for (let i = 0; i < length + radius; i++) {
      if (i < length && marked[k * line + i * step]) reach = i + 2 * radius;
      const at = i - radius;
      if (at >= 0 && reach >= i) out[k * line + at * step] = 1;
    }
  }
  return out;
}
