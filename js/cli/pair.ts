import { loadPair } from "../cases/case.js";
import type { PairFiles } from "../cases/case-file.js";
import { stitch, type Model } from "../index.js";
import { inputPaths, type Outputs, type StitchCommand } from "./arguments.js";
import { matchColours } from "./colours.js";
import { withDecoder } from "./decoding.js";
import type { Stitched } from "./produced.js";
import { readingOf, type ProgressLine } from "./progress.js";

/** Reads and stitches two photos. */
export async function stitchPairFiles(
  { settings, outputs, workers }: StitchCommand,
  files: PairFiles,
  line: ProgressLine,
): Promise<Stitched> {
  const onFile = readingOf(inputPaths(files), line);
  const pair = await withDecoder((by) => loadPair(files, onFile, by));
  const { matches, targetDepth, referenceDepth } = pair;
  const [ofTarget, ofReference] = pair.metadata;
  const photos = [
    { image: pair.target, metadata: ofTarget },
    { image: pair.reference, metadata: ofReference },
  ];
  const colours = await matchColours([files.target, files.reference], photos, 1);
  const [target = pair.target, reference = pair.reference] = colours.images;
  const call = { onProgress: line.show, workers, transfer: true };
  const result = await stitch(target, reference, {
    ...settings,
    ...call,
    outputs: neededFor(outputs),
    matches,
    targetDepth,
    referenceDepth,
  });
  const { report: fit, quality } = result;
  // PSNR is always given together with coverage.
  const agreement =
    `PSNR ${quality.psnrMask.toFixed(2)} dB and SSIM ${quality.ssimMask.toFixed(3)} ` +
    `over ${(100 * quality.coverage).toFixed(0)} % of the reference`;
  return {
    result,
    colours,
    reference: 1,
    report: {
      target: { file: files.target, width: target.width, height: target.height },
      reference: { file: files.reference, width: reference.width, height: reference.height },
      depth: files.depth,
      matches: files.matches,
      forward: plain(result.forward),
      reverse: plain(result.reverse),
      fit,
      inliers: Array.from(result.inliers),
      gains: result.gains,
      quality,
    },
    warnings: fit.warnings.map(({ code, message }) => `${code}: ${message}`),
    summary: `${fit.inliers} of ${fit.matches} matches, ${agreement}`,
  };
}

/** The pictures and masks that the files are made of. */
function neededFor({ warped, voidMask, report }: Outputs): ("mosaic" | "warped" | "voidMask")[] {
  return [
    "mosaic",
    ...(warped ? (["warped"] as const) : []),
    ...(voidMask || report ? (["voidMask"] as const) : []),
  ];
}

/** A model with plain arrays for JSON; H in row-major order. */
function plain({ h, e }: Model): { h: number[]; e: number[] } {
  return { h: Array.from(h), e: Array.from(e) };
}
