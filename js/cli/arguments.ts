import { extname, resolve } from "node:path";
import { parseArgs, type ParseArgsConfig } from "node:util";

import { systemCode } from "../cases/errors.js";
import type { PairFiles } from "../cases/case.js";
import type { Options } from "../index.js";
import { SETTING_NAMES, applySetting, flagName, parseChoice, parseNumber } from "./settings.js";
import { UsageError } from "./usage.js";

/** Where the results go. */
export interface Outputs {
  readonly mosaic: string;
  readonly warped: string | undefined;
  readonly voidMask: string | undefined;
  readonly report: string | undefined;
}

/** What a command line asks for. */
export type Command = { readonly kind: "help" } | { readonly kind: "version" } | StitchCommand;

export interface StitchCommand {
  readonly kind: "stitch";
  /** A case folder, or the files themselves. */
  readonly input: { readonly case: string } | PairFiles;
  /** Whether to match the photos even if a case brings matches. */
  readonly ownMatches: boolean;
  readonly settings: Partial<Options>;
  readonly outputs: Outputs;
  /** Which part of the mosaic is written. */
  readonly crop: Crop;
  /** Quality of JPEG outputs, 1 to 100. */
  readonly quality: number;
  /** Whether to report progress; undefined: when stderr is a terminal. */
  readonly progress: boolean | undefined;
  readonly quiet: boolean;
}

/** Where the mosaic goes when nobody says. */
export const DEFAULT_OUTPUT = "mosaic.png";
export const DEFAULT_QUALITY = 92;

/** What of the mosaic can be kept: all, the largest full rectangle, the smallest one with everything. */
const CROPS = ["none", "inner", "bounds"] as const;
export type Crop = (typeof CROPS)[number];

const IMAGE = [".png", ".jpg", ".jpeg"];

const FLAGS = {
  case: { type: "string" },
  "target-depth": { type: "string" },
  "reference-depth": { type: "string" },
  "depth-kind": { type: "string" },
  "depth-scale": { type: "string" },
  invalid: { type: "string" },
  matches: { type: "string", short: "m" },
  "own-matches": { type: "boolean" },
  output: { type: "string", short: "o" },
  warped: { type: "string" },
  "void-mask": { type: "string" },
  report: { type: "string" },
  quality: { type: "string" },
  crop: { type: "string" },
  progress: { type: "boolean" },
  quiet: { type: "boolean", short: "q" },
  help: { type: "boolean", short: "h" },
  version: { type: "boolean", short: "V" },
} as const satisfies ParseArgsConfig["options"];

/** The flags that say which files to read; a case folder says it all by itself. */
const INPUT_FLAGS = [
  "target-depth",
  "reference-depth",
  "depth-kind",
  "depth-scale",
  "invalid",
  "matches",
] as const;

/**
 * Understands a command line (without `node` and the script).
 *
 * @throws UsageError with one line for the person who typed it.
 */
export function parseCommand(args: readonly string[]): Command {
  const settingFlags = Object.fromEntries(
    SETTING_NAMES.map((name) => [flagName(name), { type: "string" } as const]),
  );
  const { values, positionals } = parse(args, settingFlags);
  const flags: Flags = values;
  if (flags.help) return { kind: "help" };
  if (flags.version) return { kind: "version" };

  const settings: Partial<Options> = {};
  for (const name of SETTING_NAMES) {
    const text = Object.entries(values).find(([flag]) => flag === flagName(name))?.[1];
    if (typeof text === "string") applySetting(settings, name, text, `--${flagName(name)}`);
  }
  if (flags["own-matches"] && flags.matches !== undefined)
    throw new UsageError("--own-matches and --matches exclude each other");
  const input = parseInput(flags, positionals);
  const outputs = parseOutputs(flags);
  const crop = labelled("crop", () => parseChoice(flags.crop ?? "none", CROPS));
  const quality = flags.quality === undefined ? DEFAULT_QUALITY : number("quality", flags.quality);
  if (!(quality >= 1 && quality <= 100))
    throw new UsageError(`--quality must be from 1 to 100, got ${quality}`);
  checkPaths(outputs, "case" in input ? [] : inputPaths(input));
  return {
    kind: "stitch",
    input,
    ownMatches: flags["own-matches"] ?? false,
    settings,
    outputs,
    crop,
    quality: Math.round(quality),
    progress: flags.progress,
    quiet: flags.quiet ?? false,
  };
}

/** Says that an output would be written over an input or over another output. */
export function checkPaths(outputs: Outputs, inputs: readonly string[]): void {
  const taken = new Map(inputs.map((path) => [resolve(path), "is an input"]));
  for (const path of outputPaths(outputs)) {
    const use = taken.get(resolve(path));
    if (use !== undefined) throw new UsageError(`cannot write to ${path}: it ${use}`);
    taken.set(resolve(path), "is another output");
  }
}

/** Every file that will be read. */
export function inputPaths({ target, reference, matches, depth }: PairFiles): string[] {
  return [target, reference, matches, depth?.target, depth?.reference].filter(
    (path) => typeof path === "string",
  );
}

/** Every file that will be written. */
export function outputPaths({ mosaic, warped, voidMask, report }: Outputs): string[] {
  return [mosaic, warped, voidMask, report].filter((path) => path !== undefined);
}

type Flags = {
  readonly [F in keyof typeof FLAGS]?: (typeof FLAGS)[F]["type"] extends "boolean"
    ? boolean
    : string;
};

function parse(args: readonly string[], settingFlags: Record<string, { type: "string" }>) {
  try {
    return parseArgs({
      args: joinNegativeNumbers(args),
      options: { ...settingFlags, ...FLAGS },
      allowPositionals: true,
    });
  } catch (error) {
    if (!(error instanceof Error) || !systemCode(error)?.startsWith("ERR_PARSE_ARGS")) throw error;
    throw new UsageError(error.message);
  }
}

/** `--invalid -1` as `--invalid=-1`: parseArgs takes what begins with a dash for a flag, and no flag is a number. */
function joinNegativeNumbers(args: readonly string[]): string[] {
  const joined: string[] = [];
  for (const arg of args) {
    const flag = joined.at(-1);
    const isValue =
      /^-\.?\d/.test(arg) && flag !== "--" && flag?.startsWith("--") && !flag.includes("=");
    if (isValue) joined.splice(-1, 1, `${flag}=${arg}`);
    else joined.push(arg);
  }
  return joined;
}

function parseInput(flags: Flags, positionals: readonly string[]): StitchCommand["input"] {
  if (flags.case !== undefined) {
    if (positionals.length > 0)
      throw new UsageError("--case brings its own photos: give no others");
    const extra = INPUT_FLAGS.find((flag) => flags[flag] !== undefined);
    if (extra)
      throw new UsageError(
        `--${extra} cannot be combined with --case: ${extra} comes from its case.json`,
      );
    return { case: flags.case };
  }
  const [target, reference] = positionals;
  if (target === undefined || reference === undefined || positionals.length > 2) {
    throw new UsageError(
      `two photos are needed, TARGET and REFERENCE, got ${positionals.length} (see --help)`,
    );
  }
  return { target, reference, matches: flags.matches ?? null, depth: parseDepth(flags) };
}

function parseDepth(flags: Flags): PairFiles["depth"] {
  const { "target-depth": target, "reference-depth": reference } = flags;
  if (target === undefined && reference === undefined) {
    const extra = (["depth-kind", "depth-scale", "invalid"] as const).find(
      (flag) => flags[flag] !== undefined,
    );
    if (extra) throw new UsageError(`--${extra} needs --target-depth or --reference-depth`);
    return null;
  }
  const kind = labelled("depth-kind", () =>
    parseChoice(flags["depth-kind"] ?? "inverse", ["inverse", "metric"]),
  );
  const scale = number("depth-scale", flags["depth-scale"] ?? "1");
  if (scale <= 0) throw new UsageError(`--depth-scale must be above 0, got ${scale}`);
  const invalid = flags.invalid === undefined ? null : number("invalid", flags.invalid);
  return { target: target ?? null, reference: reference ?? null, kind, scale, invalid };
}

function parseOutputs(flags: Flags): Outputs {
  const output = (
    flag: "output" | "warped" | "void-mask",
    extensions: readonly string[],
  ): string | undefined => {
    const path = flags[flag];
    if (path === undefined || extensions.includes(extname(path).toLowerCase())) return path;
    throw new UsageError(`--${flag} must end in ${extensions.join(" or ")}, got ${path}`);
  };
  return {
    mosaic: output("output", IMAGE) ?? DEFAULT_OUTPUT,
    // JPEG has no alpha, and the alpha of the warped photo is what is valid of it.
    warped: output("warped", [".png"]),
    voidMask: output("void-mask", [".png"]),
    report: flags.report,
  };
}

function number(flag: string, text: string): number {
  return labelled(flag, () => parseNumber(text));
}

function labelled<T>(flag: string, read: () => T): T {
  try {
    return read();
  } catch (error) {
    if (error instanceof UsageError) throw new UsageError(`--${flag} must be ${error.message}`);
    throw error;
  }
}
