import type { Pair, PairFiles } from "../cases/case.js";
import type { Mask, Model, Options, Size, StitchResultOf } from "../index.js";
import type { Outputs } from "./arguments.js";

/** The JSON of `--report`: everything in a result except images. */
export function report(
  version: string,
  files: PairFiles,
  pair: Pair,
  options: Options,
  outputs: Outputs,
  result: StitchResultOf<"mosaic" | "voidMask">,
): object {
  const { width, height } = result.mosaic;
  return {
    version,
    target: { file: files.target, width: pair.target.width, height: pair.target.height },
    reference: {
      file: files.reference,
      width: pair.reference.width,
      height: pair.reference.height,
    },
    depth: files.depth,
    matches: files.matches,
    options,
    forward: plain(result.forward),
    reverse: plain(result.reverse),
    fit: result.report,
    inliers: Array.from(result.inliers),
    crop: result.crop,
    gains: result.gains,
    canvas: { width, height, offset: result.offset, clipped: result.clipped },
    projection: result.projection,
    voidPixels: pixelsIn(result.voidMask),
    quality: result.quality,
    times: result.times,
    outputs,
  };
}

/** The number of pixels in a mask. */
export function pixelsIn({ data }: Mask): number {
  return data.reduce((count, value) => count + (value === 0 ? 0 : 1), 0);
}

/** The summary in one line. PSNR is always given together with coverage. */
export function summary(
  outputs: Outputs,
  mosaic: Size,
  { quality, report: fit }: StitchResultOf<never>,
): string {
  const agreement =
    `PSNR ${quality.psnrMask.toFixed(2)} dB and SSIM ${quality.ssimMask.toFixed(3)} ` +
    `over ${(100 * quality.coverage).toFixed(0)} % of the reference`;
  return `${outputs.mosaic}: ${mosaic.width}×${mosaic.height}, ${fit.inliers} of ${fit.matches} matches, ${agreement}`;
}

/** A model with plain arrays for JSON; H in row-major order. */
function plain({ h, e }: Model): { h: number[]; e: number[] } {
  return { h: Array.from(h), e: Array.from(e) };
}
