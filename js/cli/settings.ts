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
  fill: choice("whether inner voids of the mosaic are filled", "smooth", "none"),
  fillRadius: number("radius in pixels of the neighbourhood that a filled pixel is drawn from"),
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

function choice<T extends string>(help: string, ...words: readonly T[]): Setting<T> {
  return { placeholder: words.join("|"), help, parse: (text) => parseChoice(text, words) };
}
