import type { StitchResult, Stage } from "depthstitch";
import { count, decibels, percent, pixels, seconds, similarity } from "./number-words.js";
import type { Outcome } from "./state.js";

export const stageWords: Readonly<Record<Stage, { name: string; doing: string }>> = {
  input: { name: "Read", doing: "Reading the photos" },
  estimate: { name: "Fit", doing: "Fitting the geometry" },
  warp: { name: "Warp", doing: "Warping the target" },
  measure: { name: "Measure", doing: "Measuring the overlap" },
  blend: { name: "Blend", doing: "Blending the photos" },
  fill: { name: "Fill", doing: "Filling the voids" },
};

/** In the order in which the pipeline runs them. */
export const stages: readonly Stage[] = ["input", "estimate", "warp", "measure", "blend", "fill"];

/** The four figures at the top: a value and a line under it. PSNR and SSIM never stand without coverage. */
export function keyFigures({ report, quality }: StitchResult) {
  const coverage = `over ${percent(quality.coverage)} of the reference`;
  return {
    model: {
      value: report.model === "depth" ? "With parallax" : "Homography",
      under: report.model === "depth" ? "plane + inverse depth" : "no parallax in the model",
    },
    inliers: {
      value: `${report.inliers} / ${report.usable}`,
      under: `within ${pixels(report.threshold)}`,
    },
    psnr: { value: decibels(quality.psnrMask), under: coverage },
    ssim: { value: similarity(quality.ssimMask), under: coverage },
  };
}

/** The report in sentences. */
export function reportParagraphs({ result, elapsed, options }: Outcome): string[] {
  const { report, offset, mosaic, voidMask } = result;
  const model =
    report.model === "depth"
      ? "The photos are aligned with parallax: each pixel of the target moves by a homography and, along its epipolar line, by its inverse depth."
      : "The photos are aligned by a homography: it is exact for a flat scene or a camera that only turned, and leaves near things displaced otherwise.";
  const unusable = report.matches - report.usable;
  const dropped =
    unusable > 0
      ? `${unusable} of the ${report.matches} matches were not usable: doubled, outside the photos, or without depth. `
      : "";
  const [forward, reverse] = report.residual;
  const fit =
    `${dropped}${report.inliers} of ${count(report.usable, "usable match agrees", "usable matches agree")} with it within ${pixels(report.threshold)}, ` +
    `found in ${count(report.trials, "trial", "trials")}. Their median error is ${pixels(forward)} from target to reference and ${pixels(reverse)} back.`;
  const voids = countSet(voidMask.data);
  const voidShare = percent(voids / (voidMask.width * voidMask.height));
  const filled = options.fill === "none" ? "left empty" : "filled from their surroundings";
  const canvas =
    `The mosaic has ${mosaic.width} × ${mosaic.height} pixels; the reference begins at ${offset.x}, ${offset.y}. ` +
    (voids > 0
      ? `${count(voids, "pixel", "pixels")} (${voidShare}) inside the target's outline were seen by neither photo and were ${filled}.`
      : "No pixel inside the target's outline is left uncovered.");
  return [model, fit, canvas, `All of it took ${seconds(elapsed)}, in a worker.`];
}

export function countSet(mask: Uint8Array): number {
  let set = 0;
  for (const value of mask) if (value !== 0) set++;
  return set;
}

/** The agreement table: how it was measured, PSNR, SSIM, coverage. */
export function qualityRows({ quality }: StitchResult): readonly (readonly string[])[] {
  const coverage = percent(quality.coverage);
  return [
    ["Valid pixels", decibels(quality.psnrMask), similarity(quality.ssimMask), coverage],
    [
      "Bounding box, as the paper",
      decibels(quality.psnrBbox),
      similarity(quality.ssimBbox),
      coverage,
    ],
  ];
}

/** The report for programs: every number of the result, no pixels. */
export function reportJson({ result, slots, options, elapsed }: Outcome, version: string): string {
  const { forward, reverse, report, quality, times, offset, mosaic, inliers, clipped, voidMask } =
    result;
  const model = ({ h, e }: { h: Float64Array; e: Float64Array }) => ({ h: [...h], e: [...e] });
  const value = {
    version,
    inputs: Object.fromEntries(
      Object.entries(slots).map(([slot, loaded]) => [slot, loaded?.file ?? null]),
    ),
    options,
    canvas: {
      width: mosaic.width,
      height: mosaic.height,
      offset,
      clipped,
      voids: countSet(voidMask.data),
    },
    forward: model(forward),
    reverse: model(reverse),
    report,
    quality,
    times,
    elapsed,
    inliers: [...inliers],
  };
  return `${JSON.stringify(value, null, 2)}\n`;
}
