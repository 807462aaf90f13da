import type { FitReport, StitchResult } from "depthstitch";
import type { Outcome, Running, Settings } from "../state.js";
import type { Photo } from "../studio/contents.js";
import { count, decibels, percent, pixels, seconds, similarity } from "./numbers.js";

export const stageWords: Readonly<Record<Running["stage"], { name: string; doing: string }>> = {
  "model-depth": { name: "Depth network", doing: "Estimating depth" },
  input: { name: "Read", doing: "Reading the photos" },
  detect: { name: "Find features", doing: "Looking for features" },
  match: { name: "Match them", doing: "Matching the features" },
  estimate: { name: "Fit the geometry", doing: "Fitting the geometry" },
  depth: { name: "Find depth", doing: "Finding depth from the two photos" },
  refine: { name: "Refine depth", doing: "Refining the depth" },
  warp: { name: "Move the first photo", doing: "Moving the first photo" },
  measure: { name: "Measure", doing: "Measuring the overlap" },
  blend: { name: "Join", doing: "Joining the photos" },
  fill: { name: "Fill voids", doing: "Filling the voids" },
  "model-fill": { name: "Filling network", doing: "Filling the voids" },
};

/** In the order in which they are gone through. */
export const stages: readonly Running["stage"][] = [
  "model-depth",
  "input",
  "detect",
  "match",
  "estimate",
  "depth",
  "refine",
  "warp",
  "measure",
  "blend",
  "fill",
  "model-fill",
];

const modelWords: Readonly<
  Record<FitReport["model"], { name: string; under: string; sentence: string }>
> = {
  depth: {
    name: "With depth",
    under: "plane + parallax",
    sentence:
      "The photos are aligned with parallax: each pixel of the first moves by a homography and, along its epipolar line, by its inverse depth.",
  },
  calibrated: {
    name: "With depth",
    under: "calibrated camera",
    sentence:
      "The photos are aligned with parallax, by a rotation, a translation and one focal length: fewer numbers than a free fit, so what lies outside the overlap stays in place.",
  },
  "two-view": {
    name: "From two views",
    under: "depth from the photos",
    sentence:
      "The photos are aligned with parallax, and the depth for it comes from the photos themselves. Outside their overlap it is continued smoothly.",
  },
  homography: {
    name: "Homography",
    under: "no parallax in it",
    sentence:
      "The photos are aligned by a homography: it is exact for a flat scene or a camera that only turned, and leaves near things displaced otherwise.",
  },
};

/** The four figures at the top: a value and a line under it. PSNR and SSIM never stand without coverage. */
export function keyFigures({ report, quality }: StitchResult) {
  const coverage = `coverage ${percent(quality.coverage)}`;
  const { name, under } = modelWords[report.model];
  return {
    model: { value: name, under },
    inliers: {
      value: `${report.inliers} / ${report.usable}`,
      under: `within ${pixels(report.threshold)}`,
    },
    psnr: { value: decibels(quality.psnrMask), under: coverage },
    ssim: { value: similarity(quality.ssimMask), under: coverage },
  };
}

/** The report in sentences. */
export function reportParagraphs({ result, job, settings, elapsed }: Outcome): string[] {
  const { report, offset, mosaic, voidMask } = result;
  const model = modelWords[report.model].sentence;
  const focal =
    report.focalLength === null
      ? ""
      : ` The focal length is ${count(Math.round(report.focalLength), "pixel", "pixels")} of the first photo.`;
  const source = job.matches ? "given" : "found";
  const unusable = report.matches - report.usable;
  const dropped =
    unusable > 0
      ? `${unusable} of the ${report.matches} matches ${source} were not usable: doubled, outside the photos, or without depth. `
      : "";
  const followed =
    report.followed > 0
      ? `As the depth is exact, ${count(report.followed, "more point was", "more points were")} followed over the overlap and fitted, too. `
      : "";
  const [forward, reverse] = report.residual;
  const fit =
    `${dropped}${report.inliers} of ${count(report.usable, "usable match agrees", "usable matches agree")} with it within ${pixels(report.threshold)}, ` +
    `found in ${count(report.trials, "trial", "trials")}. ${followed}Their median error is ${pixels(forward)} from target to reference and ${pixels(reverse)} back.`;
  const voids = countSet(voidMask.data);
  const voidShare = percent(voids / (voidMask.width * voidMask.height));
  const filled = fillSentence(settings);
  const canvas =
    `The mosaic has ${mosaic.width} × ${mosaic.height} pixels; the second photo begins at ${offset.x}, ${offset.y}. ` +
    (voids > 0
      ? `${count(voids, "pixel", "pixels")} (${voidShare}) inside the first photo's outline ${voids === 1 ? "was" : "were"} seen by neither photo and ${voids === 1 ? "was" : "were"} ${filled}.`
      : "No pixel inside the first photo's outline is left uncovered.");
  return [
    model + focal,
    fit,
    canvas,
    `All of it took ${seconds(elapsed)}, in a worker of this page.`,
  ];
}

function fillSentence({ filler, options }: Settings): string {
  if (filler === "migan") return "invented by MI-GAN";
  if (filler === "lama") return "invented by LaMa";
  return options.fill === "none" ? "left empty" : "filled from their surroundings";
}

/** How many of a mask's bytes, each 0 or 255, are 255; four at a time, as masks are as large as pictures. */
export function countSet(mask: Uint8Array<ArrayBuffer>): number {
  const words = new Uint32Array(mask.buffer, mask.byteOffset, mask.length >> 2);
  let set = 0;
  for (let i = 0; i < words.length; i++) {
    set += Math.imul((words[i] ?? 0) & 0x01010101, 0x01010101) >>> 24;
  }
  for (let i = 4 * words.length; i < mask.length; i++) if (mask[i]) set++;
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
export function reportJson(
  { result, job, slots, settings, elapsed }: Outcome,
  version: string,
): string {
  const { forward, reverse, report, quality, times, offset, mosaic, inliers, clipped, voidMask } =
    result;
  const model = ({ h, e }: { h: Float64Array; e: Float64Array }) => ({ h: [...h], e: [...e] });
  const value = {
    version,
    inputs: Object.fromEntries(
      Object.entries(slots).map(([slot, loaded]) => [slot, loaded?.file.name ?? null]),
    ),
    sizes: { target: sizeOf(job.target), reference: sizeOf(job.reference) },
    depthSource: settings.depthSource,
    filler: settings.filler,
    options: job.options,
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
    matches: [...result.matches],
    inliers: [...inliers],
  };
  return `${JSON.stringify(value, null, 2)}\n`;
}

function sizeOf({ width, height, original }: Photo) {
  return { width, height, original };
}
