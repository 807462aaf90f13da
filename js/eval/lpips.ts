import type { ImageInput, StitchResult } from "../index.js";
import { openSession } from "../models/runtime.js";

/** R. Zhang et al., *The Unreasonable Effectiveness of Deep Features as a Perceptual Metric*, CVPR 2018: 0 of the same. */
export interface PerceptualDistance {
  /** Of the overlap's bounding box, both pictures black outside the overlap, as in `psnr_bbox`; null where there is none. */
  measure(
    result: Pick<StitchResult, "warped" | "offset">,
    reference: ImageInput,
  ): Promise<number | null>;
  dispose(): Promise<void>;
}

/**
 * The distance by a network of the caller's: two inputs [1, 3, height, width] of red, green and blue from −1 to 1, whose
 * first output begins with the distance.
 *
 * @throws {StitchError} `model-load-failed`.
 */
export async function perceptualDistance(network: Uint8Array): Promise<PerceptualDistance> {
  const session = await openSession(network, { device: "wasm", cache: false });
  return {
    async measure({ warped, offset }, reference) {
      const box = overlapBox(warped, offset, reference);
      if (!box) return null;
      const dims = [1, 3, box.bottom - box.top, box.right - box.left];
      const [width, pixels] = [
        box.right - box.left,
        (box.bottom - box.top) * (box.right - box.left),
      ];
      const [a, b] = [new Float32Array(3 * pixels), new Float32Array(3 * pixels)];
      for (let i = 0; i < pixels; i++) {
        const [x, y] = [box.left + (i % width), box.top + Math.floor(i / width)];
        const from = 4 * ((y + offset.y) * warped.width + x + offset.x);
        const valid = warped.data[from + 3] !== 0;
        for (let c = 0; c < 3; c++) {
          const own = warped.data[from + c] as number;
          const other = reference.data[4 * (y * reference.width + x) + c] as number;
          a[c * pixels + i] = (valid ? own : 0) / 127.5 - 1;
          b[c * pixels + i] = (valid ? other : 0) / 127.5 - 1;
        }
      }
      const { data } = await session.run([
        { data: a, dims },
        { data: b, dims },
      ]);
      return data[0] ?? null;
    },
    dispose: () => session.dispose(),
  };
}

/** The smallest rectangle of the reference with every pixel that the warped target covers. */
function overlapBox(
  warped: ImageInput,
  offset: { readonly x: number; readonly y: number },
  { width, height }: ImageInput,
): { left: number; right: number; top: number; bottom: number } | undefined {
  let [left, right, top, bottom] = [Infinity, -Infinity, Infinity, -Infinity];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      if (warped.data[4 * ((y + offset.y) * warped.width + x + offset.x) + 3] === 0) continue;
      [left, right] = [Math.min(left, x), Math.max(right, x + 1)];
      [top, bottom] = [Math.min(top, y), Math.max(bottom, y + 1)];
    }
  }
  return right > left ? { left, right, top, bottom } : undefined;
}
