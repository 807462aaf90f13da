import type { FitReport } from "depthstitch";
import type { Photo } from "../image-worker/contents.js";
import type { PairResult } from "../run/kept.js";
import type { Outcome, Running, Settings } from "../state.js";
import { count, decibels, percent, pixels, seconds, similarity } from "./numbers.js";

/** In the order in which they are run. */
export const stageText: Readonly<Record<Running["stage"], { name: string; doing: string }>> = {
  "model-depth": { name: "Depth network", doing: "Estimating depth" },
  input: { name: "Read", doing: "Reading the photos" },
  detect: { name: "Detect features", doing: "Detecting features" },
  match: { name: "Match features", doing: "Matching features" },
  estimate: { name: "Fit geometry", doing: "Fitting the geometry" },
  depth: { name: "Depth from the photos", doing: "Computing depth from the photos" },
  refine: { name: "Refine depth", doing: "Refining depth" },
  warp: { name: "Warp", doing: "Warping into one view" },
  measure: { name: "Measure", doing: "Measuring the overlap" },
  blend: { name: "Blend", doing: "Blending the photos" },
  fill: { name: "Fill gaps", doing: "Filling gaps" },
  "model-fill": { name: "Inpainting network", doing: "Inpainting gaps" },
};

export const stages = Object.keys(stageText) as readonly Running["stage"][];

const modelText: Readonly<
  Record<FitReport["model"], { name: string; under: string; sentence: string }>
> = {
  depth: {
    name: "With depth",
    under: "plane + parallax",
    sentence:
      "The photos are aligned by a plane-plus-parallax model: each pixel of the first is mapped by a homography and displaced along its epipolar line in proportion to its inverse depth.",
  },
  calibrated: {
    name: "With depth",
    under: "calibrated model",
    sentence:
      "The photos are aligned by a rotation, a translation and one focal length. This model has fewer parameters than a free plane-plus-parallax fit, which makes the extrapolation outside the overlap more accurate.",
  },
  "two-view": {
    name: "From two views",
    under: "depth from the photos",
    sentence:
      "The photos are aligned by a plane-plus-parallax model with depth estimated from the photos themselves. Outside their overlap distances are estimated.",
  },
  homography: {
    name: "Homography",
    under: "no parallax",
    sentence:
      "The photos are aligned by a homography, which is exact for planar scenes and pure rotations. Otherwise nearby objects are displaced.",
  },
};

/** The three key figures: a value and a line under it. */
export function keyFigures({ report, quality }: PairResult) {
  const { name, under } = modelText[report.model];
  return {
    model: { value: name, under },
    inliers: {
      value: `${report.inliers} / ${report.usable}`,
      under: `within ${pixels(report.threshold)}`,
    },
    overlap: {
      value: agreement(quality.ssimMask),
      under: `compared on ${percent(quality.coverage)} of it`,
    },
  };
}

/**
 * How alike the photos are where both show the same, by SSIM: with exact depth it is .9 and more, for two photos of a
 * scene in depth .6 to .8 although the seam hides most of it.
 */
function agreement(ssim: number): string {
  if (!Number.isFinite(ssim)) return "Not compared";
  return ssim >= 0.85 ? "Agrees closely" : ssim >= 0.6 ? "Agrees mostly" : "Agrees in parts";
}

/** The report in sentences. */
export function reportParagraphs(outcome: Outcome): string[] {
  return [
    modelParagraph(outcome.result.report),
    fitParagraph(outcome),
    canvasParagraph(outcome),
    `Total time: ${seconds(outcome.elapsed)}, in a worker of this page.`,
  ];
}

function modelParagraph({ model, focalLength }: FitReport): string {
  const focal =
    focalLength === null
      ? ""
      : ` The focal length is ${count(Math.round(focalLength), "pixel", "pixels")} of the first photo.`;
  return modelText[model].sentence + focal;
}

function fitParagraph({ result: { report }, job }: Outcome): string {
  const unusable = report.matches - report.usable;
  const dropped =
    unusable > 0
      ? `${unusable} of the ${report.matches} matches ${job.matches ? "given" : "found"} could not be used: duplicates, outside the photos, or without depth. `
      : "";
  const tracked =
    report.tracked > 0
      ? `As the depth is accurate, ${count(report.tracked, "additional point was", "additional points were")} tracked across the overlap and fitted as well. `
      : "";
  const [forward, reverse] = report.residual;
  return (
    `${dropped}${report.inliers} of ${count(report.usable, "usable match is an inlier", "usable matches are inliers")} within ${pixels(report.threshold)}, ` +
    `found in ${count(report.trials, "trial", "trials")}. ${tracked}The median error is ${pixels(forward)} from the first photo to the second and ${pixels(reverse)} in the other direction.`
  );
}

function canvasParagraph({
  result: { offset, mosaic, voidMask, voids },
  settings,
}: Outcome): string {
  const share = percent(voids / (voidMask.width * voidMask.height));
  const were = voids === 1 ? "is" : "are";
  return (
    `The mosaic has ${mosaic.width} × ${mosaic.height} pixels; the second photo starts at ${offset.x}, ${offset.y}. ` +
    (voids > 0
      ? `${count(voids, "pixel", "pixels")} (${share}) inside the outline of the first photo ${were} visible in neither photo and ${were} ${fillSentence(settings)}.`
      : "There are no gaps inside the outline of the first photo.")
  );
}

/** What became of the voids. */
export function fillSentence({ fillMethod, options }: Settings): string {
  if (fillMethod === "migan") return "inpainted by MI-GAN";
  if (fillMethod === "lama") return "inpainted by LaMa";
  return options.fill === "none" ? "left transparent" : "filled from their surroundings";
}

/** Rows of the quality table: measure, PSNR, SSIM, coverage. */
export function qualityRows({ quality }: PairResult): readonly (readonly string[])[] {
  const coverage = percent(quality.coverage);
  return [
    ["Valid pixels", decibels(quality.psnrMask), similarity(quality.ssimMask), coverage],
    [
      "Bounding box, as in the paper",
      decibels(quality.psnrBbox),
      similarity(quality.ssimBbox),
      coverage,
    ],
  ];
}

/** The report of two photos as JSON: everything in a result except images. */
export function reportJson(
  { result, job, slots, settings, elapsed }: Outcome,
  version: string,
): string {
  const { forward, reverse, report, quality, times, matches, inliers } = result;
  const { mosaic, offset, clipped, voids, projection, crop, gains } = result;
  const model = ({ h, e }: { h: Float64Array; e: Float64Array }) => ({ h: [...h], e: [...e] });
  const value = {
    version,
    inputs: Object.fromEntries(
      Object.entries(slots).map(([slot, loaded]) => [slot, loaded?.file.name ?? null]),
    ),
    sizes: { target: sizeOf(job.target), reference: sizeOf(job.reference) },
    depthSource: settings.depthSource,
    fillMethod: settings.fillMethod,
    options: job.options,
    canvas: {
      width: mosaic.width,
      height: mosaic.height,
      offset,
      clipped,
      voids,
    },
    projection,
    crop,
    gains,
    forward: model(forward),
    reverse: model(reverse),
    report,
    quality,
    times,
    elapsed,
    matches: [...matches],
    inliers: [...inliers],
  };
  return `${JSON.stringify(value, null, 2)}\n`;
}

export function sizeOf({ width, height, original }: Photo) {
  return { width, height, original };
}
