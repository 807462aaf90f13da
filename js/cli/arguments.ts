import { extname, resolve } from "node:path";
import { parseArgs, type ParseArgsConfig } from "node:util";

import { systemCode } from "../cases/errors.js";
import type { DepthFormat, PairFiles } from "../cases/case-file.js";
import { numberOfWorkers, WORKERS } from "../choices.js";
import type { CallOptions, Options } from "../index.js";
import { SETTING_NAMES, applySetting, flagName, parseChoice, parseNumber } from "./settings.js";
import { identity } from "./identity.js";
import { UsageError } from "./usage.js";

/** Paths of the results. */
export interface Outputs {
  readonly mosaic: string;
  readonly warped: string | undefined;
  readonly voidMask: string | undefined;
  readonly report: string | undefined;
}

/** A parsed command line. */
export type Command =
  { readonly kind: "help" } | { readonly kind: "version" } | StitchCommand | StitchManyCommand;

export interface StitchCommand extends CommonCommand {
  readonly kind: "stitch";
  /** A case folder, or the files. */
  readonly input: { readonly case: string } | PairFiles;
  /** Whether to detect and match features even if the case has matches. */
  readonly ownMatches: boolean;
}

export interface StitchManyCommand extends CommonCommand {
  readonly kind: "stitch-many";
  readonly photos: readonly string[];
  /** The depth map of each photo, or null; null without any. */
  readonly depth: (DepthFormat & { readonly files: readonly (string | null)[] }) | null;
  /** The file with the cameras of all photos. */
  readonly cameras: string | undefined;
  /** The distortion of their lens. */
  readonly distortion: number | undefined;
  /** Which of them all are shown from the view of; undefined: the one in the middle. */
  readonly reference: number | undefined;
}

interface CommonCommand {
  readonly settings: Partial<Options>;
  readonly outputs: Outputs;
  /** The part of the mosaic that is saved. */
  readonly crop: Crop;
  /** Quality of JPEG outputs, 1 to 100. */
  readonly quality: number;
  /** How many workers may share the work. */
  readonly workers: NonNullable<CallOptions["workers"]>;
  /** Whether to report progress; undefined: if stderr is a terminal. */
  readonly progress: boolean | undefined;
  readonly quiet: boolean;
}

/** Default path of the mosaic. */
export const DEFAULT_OUTPUT = "mosaic.png";
export const DEFAULT_QUALITY = 92;

/** Parts of the mosaic that can be saved: the whole canvas, the largest opaque rectangle, the bounding box. */
const CROPS = ["none", "inner", "bounds"] as const;
export type Crop = (typeof CROPS)[number];

const IMAGE = [".png", ".jpg", ".jpeg"];

const FLAGS = {
  case: { type: "string" },
  "target-depth": { type: "string" },
  "reference-depth": { type: "string" },
  depth: { type: "string", multiple: true },
  "depth-kind": { type: "string" },
  "depth-scale": { type: "string" },
  invalid: { type: "string" },
  matches: { type: "string", short: "m" },
  "own-matches": { type: "boolean" },
  cameras: { type: "string" },
  distortion: { type: "string" },
  reference: { type: "string" },
  output: { type: "string", short: "o" },
  warped: { type: "string" },
  "void-mask": { type: "string" },
  report: { type: "string" },
  quality: { type: "string" },
  crop: { type: "string" },
  workers: { type: "string" },
  progress: { type: "boolean" },
  quiet: { type: "boolean", short: "q" },
  help: { type: "boolean", short: "h" },
  version: { type: "boolean", short: "V" },
} as const satisfies ParseArgsConfig["options"];

/** Flags for input files, which are excluded by --case. */
const INPUT_FLAGS = [
  "target-depth",
  "reference-depth",
  "depth-kind",
  "depth-scale",
  "invalid",
  "matches",
] as const;

/** Flags that only two photos have, and that only more have. */
const PAIR_FLAGS = ["target-depth", "reference-depth", "matches", "own-matches", "warped"] as const;
const MANY_FLAGS = ["reference", "depth", "cameras", "distortion"] as const;

/** Stands for a photo without a depth map. */
const NO_DEPTH = "none";

/**
 * Parses a command line (without `node` and the script).
 *
 * @throws {UsageError} with a message of one line.
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
    throw new UsageError("--own-matches and --matches are mutually exclusive");
  const outputs = parseOutputs(flags);
  const crop = labelled("crop", () => parseChoice(flags.crop ?? "none", CROPS));
  const quality = flags.quality === undefined ? DEFAULT_QUALITY : number("quality", flags.quality);
  if (!(quality >= 1 && quality <= 100))
    throw new UsageError(`--quality must be from 1 to 100, got ${quality}`);
  const common: CommonCommand = {
    settings,
    outputs,
    crop,
    quality: Math.round(quality),
    workers: parseWorkers(flags.workers),
    progress: flags.progress,
    quiet: flags.quiet ?? false,
  };
  if (positionals.length > 2 && flags.case === undefined) {
    const given = parseMany(flags, positionals);
    checkPaths(outputs, manyInputPaths(given));
    return { kind: "stitch-many", ...given, ...common };
  }
  if (flags.reference !== undefined)
    throw new UsageError("--reference needs three photos or more; of two, the second one is it");
  const many = MANY_FLAGS.find((flag) => flags[flag] !== undefined);
  if (many) throw new UsageError(`--${many} needs three photos or more`);
  const input = parseInput(flags, positionals);
  checkPaths(outputs, "case" in input ? [] : inputPaths(input));
  return { kind: "stitch", input, ownMatches: flags["own-matches"] ?? false, ...common };
}

function parseWorkers(text = "auto"): CommonCommand["workers"] {
  const word = labelled("workers", () => parseChoice(text, WORKERS.map(String)));
  return numberOfWorkers(word === "auto" ? word : Number(word));
}

type ManyFiles = Pick<
  StitchManyCommand,
  "photos" | "depth" | "cameras" | "distortion" | "reference"
>;

function parseMany(flags: Flags, photos: readonly string[]): ManyFiles {
  const extra = PAIR_FLAGS.find((flag) => flags[flag] !== undefined);
  if (extra) throw new UsageError(`--${extra} is for two photos, got ${photos.length}`);
  const { depth, cameras } = flags;
  if (depth && depth.length !== photos.length)
    throw new UsageError(
      `--depth must be given once for each of the ${photos.length} photos ("${NO_DEPTH}" for one without a map), got ${depth.length}`,
    );
  const files = depth?.map((path) => (path === NO_DEPTH ? null : path));
  const format = parseFormat(flags, files && "--depth", "--depth");
  return {
    photos,
    depth: files && format ? { ...format, files } : null,
    cameras,
    distortion: flags.distortion === undefined ? undefined : number("distortion", flags.distortion),
    reference: parseReference(flags, photos),
  };
}

/** The index of the photo that --reference names. */
function parseReference({ reference }: Flags, photos: readonly string[]): number | undefined {
  if (reference === undefined) return undefined;
  const index = photos.findIndex((photo) => resolve(photo) === resolve(reference));
  if (index < 0) throw new UsageError(`--reference must be one of the photos, got ${reference}`);
  return index;
}

/** Checks that no output overwrites an input or another output. @throws {UsageError} */
export function checkPaths(outputs: Outputs, inputs: readonly string[]): void {
  const taken = new Map(inputs.map((path) => [identity(path), "is an input"]));
  for (const path of outputPaths(outputs)) {
    const file = identity(path);
    const use = taken.get(file);
    if (use !== undefined) throw new UsageError(`cannot write to ${path}: it ${use}`);
    taken.set(file, "is another output");
  }
}

/** All files that are read. */
export function inputPaths({ target, reference, matches, depth }: PairFiles): string[] {
  return [target, reference, matches, depth?.target, depth?.reference].filter(
    (path) => typeof path === "string",
  );
}

/** All files that are read of three photos or more. */
export function manyInputPaths({
  photos,
  depth,
  cameras,
}: Pick<ManyFiles, "photos" | "depth" | "cameras">): string[] {
  return [...photos, ...(depth?.files ?? []), cameras].filter((path) => typeof path === "string");
}

/** All files that are written. */
export function outputPaths({ mosaic, warped, voidMask, report }: Outputs): string[] {
  return [mosaic, warped, voidMask, report].filter((path) => path !== undefined);
}

type Flags = {
  readonly [F in keyof typeof FLAGS]?: (typeof FLAGS)[F]["type"] extends "boolean"
    ? boolean
    : (typeof FLAGS)[F] extends { readonly multiple: true }
      ? string[]
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

/** Turns `--invalid -1` into `--invalid=-1`, as parseArgs would take -1 for a flag. No flag is a number. */
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
      throw new UsageError("--case names its own photos, so no others can be given");
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
      `two photos, TARGET and REFERENCE, or more are required, got ${positionals.length} (see --help)`,
    );
  }
  return { target, reference, matches: flags.matches ?? null, depth: parseDepth(flags) };
}

function parseDepth(flags: Flags): PairFiles["depth"] {
  const { "target-depth": target, "reference-depth": reference } = flags;
  const format = parseFormat(flags, target ?? reference, "--target-depth or --reference-depth");
  return format && { target: target ?? null, reference: reference ?? null, ...format };
}

/** The format of depth maps; null without any, which are those that `needed` names. */
function parseFormat(flags: Flags, maps: string | undefined, needed: string): DepthFormat | null {
  if (maps === undefined) {
    const extra = (["depth-kind", "depth-scale", "invalid"] as const).find(
      (flag) => flags[flag] !== undefined,
    );
    if (extra) throw new UsageError(`--${extra} needs ${needed}`);
    return null;
  }
  const kind = labelled("depth-kind", () =>
    parseChoice(flags["depth-kind"] ?? "inverse", ["inverse", "metric"]),
  );
  const scale = number("depth-scale", flags["depth-scale"] ?? "1");
  if (scale <= 0) throw new UsageError(`--depth-scale must be above 0, got ${scale}`);
  const invalid = flags.invalid === undefined ? null : number("invalid", flags.invalid);
  return { kind, scale, invalid };
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
    // JPEG has no alpha channel, which is the validity mask of the warped target.
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
