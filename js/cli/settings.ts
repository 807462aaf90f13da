import type { Options } from "../index.js";
import { UsageError } from "./usage.js";

/** How one option of `stitch` is written on a command line. */
export interface Setting<T> {
  /** What stands for the value in the help. */
  readonly placeholder: string;
  readonly help: string;
  /** @throws UsageError for a value that is of another kind; the core checks the range. */
  readonly parse: (text: string) => T;
}

/** Every option of `stitch`, in the order of the help. The compiler keeps it complete; the defaults are the core's. */
export const SETTINGS: { readonly [K in keyof Options]: Setting<Options[K]> } = {
  mode: choice("which defaults the options below have", "default", "paper"),
  matchSize: number(
    "photos whose longer side has more pixels are matched at this size; 0 matches all at their own",
  ),
  maxKeypoints: number("most keypoints that are described in a photo"),
  contrastThreshold: number("least contrast of a keypoint, as a share of the range of brightness"),
  edgeThreshold: number("largest ratio of principal curvatures of a keypoint"),
  adaptiveContrast: flag("drop the contrast asked for until there are enough keypoints"),
  upsample: flag("double photos before the search, which finds the smallest features"),
  rootSift: flag("compare descriptors by their square roots (RootSIFT)"),
  matchRatio: number("a match must be closer than this many times the second best"),
  mutual: flag("both features of a match must be each other's best"),
  guidedMatching: flag("search own matches again along the epipolar lines"),
  withoutDepth: choice(
    "without depth maps: depth from the photos themselves, or a homography",
    "two-view",
    "homography",
  ),
  robustFit: choice("what picks the inliers", "depth", "homography", "multi-homography"),
  threshold: {
    placeholder: "PX|paper",
    help: "largest transfer error of an inlier in pixels, or the paper's 0.1 in normalised coordinates",
    parse: (text) => (text === "paper" ? text : parseNumber(text, 'a number or "paper"')),
  },
  confidence: number(
    "chance, 0 to 1, that one sample at least was free of outliers when sampling stops",
  ),
  maxTrials: number("most samples to draw"),
  seed: number("seed of the sampler, a whole number; the same seed gives the same bytes"),
  calibration: choice(
    "fit rotation, translation and focal length instead of twelve free numbers",
    "auto",
    "always",
    "off",
  ),
  focalLength: number("focal length of the target in its pixels; 0 where it is not known"),
  refinement: choice("refine inverse depth along the epipolar lines", "epipolar", "none"),
  refinementRange: number(
    "how far the refinement looks in pixels; 0 for as far as the residuals suggest",
  ),
  warpMode: choice("how the target is rendered", "forward", "backward", "backward+void", "optimal"),
  gridColumns: number("columns of grid cells over the target; 0 for one vertex per pixel"),
  gridRows: number("rows of grid cells over the target; 0 for one vertex per pixel"),
  holes: choice(
    "where a depth map has no value: take the nearest known one, or draw nothing there",
    "nearest",
    "drop",
  ),
  voidDistance: number(
    "a void is where the two models disagree by more than this share of the target's diagonal",
  ),
  stretchLimit: number(
    "outside the reference, a cell longer than this many average cells is a void",
  ),
  canvasLimit: number(
    "how far the canvas may reach beyond each side of the reference, in reference sizes",
  ),
  exposure: choice(
    "how the target's exposure is fitted to the reference's",
    "field",
    "gain",
    "none",
  ),
  seam: choice("whether a seam decides which photo shows where both do", "cut", "none"),
  blending: choice("how the photos are blended", "multiband", "feather", "average"),
  feather: number("pixels from one end of a feathered ramp to the other"),
  bands: number("bands of the multiband blending; 0 for as many as the size asks for"),
  fill: choice("how inner voids of the mosaic are filled", "exemplar", "smooth", "none"),
  fillRadius: number("radius in pixels of the neighbourhood that a filled pixel is drawn from"),
  fillMaxWidth: number(
    "how wide a void may be to be filled by exemplar, as a share of the picture's size",
  ),
  maxBytes: number("most bytes the core may take; a larger job is refused"),
};

/** The names of all settings, in the order of the help. */
export const SETTING_NAMES = Object.keys(SETTINGS).filter(isSettingName);

/** Whether `name` is an option of `stitch`, spelled as in JavaScript. */
export function isSettingName(name: string): name is keyof Options {
  return Object.hasOwn(SETTINGS, name);
}

/** Sets the option `name` from text. */
export function applySetting<K extends keyof Options>(
  to: Partial<Options>,
  name: K,
  text: string,
  label: string,
): void {
  try {
    to[name] = SETTINGS[name].parse(text);
  } catch (error) {
    if (error instanceof UsageError) throw new UsageError(`${label} must be ${error.message}`);
    throw error;
  }
}

/** `maxTrials` as a flag: `max-trials`. */
export function flagName(name: string): string {
  return name.replaceAll(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
}

/** The number that `text` spells in decimal. */
export function parseNumber(text: string, expected = "a number"): number {
  const value = Number(text);
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) || !Number.isFinite(value)) {
    throw new UsageError(`${expected}, got ${JSON.stringify(text)}`);
  }
  return value;
}

/** The word of `words` that `text` is. */
export function parseChoice<const T extends string>(text: string, words: readonly T[]): T {
  const found = words.find((word) => word === text);
  if (found === undefined)
    throw new UsageError(`one of ${words.join(", ")}, got ${JSON.stringify(text)}`);
  return found;
}

function number(help: string): Setting<number> {
  return { placeholder: "N", help, parse: (text) => parseNumber(text) };
}

function flag(help: string): Setting<boolean> {
  return {
    placeholder: "on|off",
    help,
    parse: (text) => parseChoice(text, ["on", "off"]) === "on",
  };
}

function choice<T extends string>(help: string, ...words: readonly T[]): Setting<T> {
  return { placeholder: words.join("|"), help, parse: (text) => parseChoice(text, words) };
}
