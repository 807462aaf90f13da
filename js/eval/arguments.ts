import { parseArgs } from "node:util";

import { systemCode } from "../cases/errors.js";
import { SETTING_NAMES, applySetting, isSettingName } from "../cli/settings.js";
import { UsageError } from "../cli/usage.js";
import type { Options } from "../index.js";
import type { Group } from "./measures.js";
import { MODES, type Mode } from "./modes.js";

/** Flags that only pairs have, and that only sets have. */
const PAIR_FLAGS = ["data", "mode", "matches", "look", "stability", "hidden", "lpips"] as const;
const SET_FLAGS = ["leave-out"] as const;

/** What an evaluation is asked to do. */
export interface Request {
  readonly data: string;
  /** Whether the folders are sets of photos for `stitchMany`, instead of pairs. */
  readonly many: boolean;
  readonly modes: readonly (readonly [name: string, mode: Mode])[];
  /** Whether a case of this name is wanted. */
  readonly wanted: (name: string) => boolean;
  /** Options on top of every mode's own. */
  readonly settings: Partial<Options>;
  /** Whether the photos are matched anew. */
  readonly ownMatches: boolean;
  /** What is measured. */
  readonly groups: ReadonlySet<Group>;
  /** File of the network for LPIPS. */
  readonly lpips: string | undefined;
  /** File of the picture sheet. */
  readonly sheet: string | undefined;
  readonly out: string | undefined;
  readonly json: string | undefined;
  readonly check: boolean;
}

/** Where the case folders are without `DEPTHSTITCH_DATA`. */
const DATA = "../shared/data";
/** Where the sets of photos are by default. */
const SETS = "../shared/many";

export const HELP = `Usage: npm run eval -- --data DIR [options]

Stitches every case folder in DIR and prints what it measures: of the overlap unless something else is asked for.

  --data DIR           folder of case folders, or one case folder [$DEPTHSTITCH_DATA, or ${DATA}]
  --many [DIR]         sets of photos instead of pairs: those used and missing, cameras against the true ones, where pixels
                       land against exact depth, steps along all seams, broken lines [${SETS}]
  --leave-out          of sets, too: one photo is left out, and what the others show there is compared with it
  --mode MODE[,MODE]   ${[...MODES.keys()].join(", ")} [default]
  --cases GLOB[,GLOB]  only the cases of these names; * and ? as in a shell
  --matches WHOSE      supplied: those of the case; own: our matcher's [supplied]
  --seed N             the sampler's seed
  --set OPTION=VALUE   any option of stitch, on top of the mode's; may be repeated
  --look               what a person sees: voids inside the reference's border and in the whole overlap, the seam's share on
                       that border, its length, visible steps along it, straight lines broken inside the reference, across
                       its border and outside, bending outside; lower is better
  --stability          how much another seed changes the outline outside the reference: 1 - intersection over union
  --hidden             hide the outer 40 % of the overlap from the reference, stitch, and compare: PSNR and SSIM at equal
                       exposure, the share shown, by how many pixels it is displaced. Stitches nothing else by itself.
  --lpips FILE.onnx    LPIPS of the overlap by this network: two inputs [1, 3, height, width] from -1 to 1
  --sheet FILE.png     a picture of every case's target, reference, mosaic by homography, and mosaics of the modes
  --out DIR            write CASE_MODE_mosaic.png and CASE_MODE_warped.png there
  --json FILE          write the rows there as JSON
  --check              compare what is measured with js/eval/floors.json; exit 1 when a number falls short
  --help               print this
`;

/**
 * Understands a command line; undefined when it asks for help.
 *
 * @throws UsageError
 */
export function parseRequest(args: readonly string[]): Request | undefined {
  const flags = parse(withDefault(args));
  if (flags.help) return undefined;
  const many = flags.many !== undefined;
  const extra = (many ? PAIR_FLAGS : SET_FLAGS).find((flag) => flags[flag] !== undefined);
  if (extra)
    throw new UsageError(`--${extra} ${many ? "cannot be combined with" : "needs"} --many`);
  const matches = flags.matches ?? "supplied";
  if (matches !== "supplied" && matches !== "own")
    throw new UsageError(`--matches must be supplied or own, got ${JSON.stringify(matches)}`);

  const settings: Partial<Options> = {};
  if (flags.seed !== undefined) applySetting(settings, "seed", flags.seed, "--seed");
  for (const assignment of flags.set ?? []) {
    const equals = assignment.indexOf("=");
    const name = assignment.slice(0, Math.max(equals, 0));
    if (!isSettingName(name)) {
      throw new UsageError(
        `--set needs OPTION=VALUE with one of ${SETTING_NAMES.join(", ")}, got ${assignment}`,
      );
    }
    if (name === "projection" && !many)
      throw new UsageError(
        "--set projection needs --many: pairs are shown on the plane, on which the measures are taken",
      );
    applySetting(settings, name, assignment.slice(equals + 1), name);
  }
  return {
    data: flags.many ?? flags.data ?? process.env.DEPTHSTITCH_DATA ?? DATA,
    many,
    modes: modeNames(flags).map((name) => [name, modeOf(name)] as const),
    wanted: globs(flags.cases ?? "*"),
    settings,
    ownMatches: matches === "own",
    groups: groupsOf(flags),
    lpips: flags.lpips,
    sheet: flags.sheet,
    out: flags.out,
    json: flags.json,
    check: flags.check ?? false,
  };
}

/** `--many` may stand alone. */
function withDefault(args: readonly string[]): string[] {
  return args.flatMap((arg, i) => {
    const alone = arg === "--many" && (args[i + 1] ?? "--").startsWith("--");
    return alone ? [arg, SETS] : [arg];
  });
}

function parse(args: readonly string[]) {
  try {
    return parseArgs({
      args: [...args],
      options: {
        data: { type: "string" },
        many: { type: "string" },
        "leave-out": { type: "boolean" },
        mode: { type: "string" },
        cases: { type: "string" },
        matches: { type: "string" },
        seed: { type: "string" },
        set: { type: "string", multiple: true },
        look: { type: "boolean" },
        stability: { type: "boolean" },
        hidden: { type: "boolean" },
        lpips: { type: "string" },
        sheet: { type: "string" },
        out: { type: "string" },
        json: { type: "string" },
        check: { type: "boolean" },
        help: { type: "boolean" },
      },
    }).values;
  } catch (error) {
    if (!(error instanceof Error) || !systemCode(error)?.startsWith("ERR_PARSE_ARGS")) throw error;
    throw new UsageError(error.message);
  }
}

/** The modes asked for; a sheet compares them with the homography. */
function modeNames({ mode = "default", sheet }: { mode?: string; sheet?: string }): string[] {
  const names = mode.split(",");
  return sheet === undefined || names.includes("baseline") ? names : ["baseline", ...names];
}

function groupsOf(flags: {
  readonly look?: boolean;
  readonly stability?: boolean;
  readonly hidden?: boolean;
  readonly lpips?: string;
  readonly many?: string;
  readonly "leave-out"?: boolean;
}): Set<Group> {
  if (flags.many !== undefined)
    return new Set<Group>(flags["leave-out"] ? ["set", "leaveOut"] : ["set"]);
  const asked = (["look", "stability", "hidden", "lpips"] as const).filter((group) => flags[group]);
  return new Set<Group>(asked.length > 0 ? asked : ["overlap"]);
}

function modeOf(name: string): Mode {
  const mode = MODES.get(name);
  if (mode) return mode;
  throw new UsageError(
    `--mode must be of ${[...MODES.keys()].join(", ")}, got ${JSON.stringify(name)}`,
  );
}

function globs(patterns: string): (name: string) => boolean {
  const expressions = patterns.split(",").map((pattern) => {
    const escaped = pattern.replaceAll(/[.+^${}()|[\]\\]/g, "\\$&");
    return new RegExp(`^${escaped.replaceAll("*", ".*").replaceAll("?", ".")}$`);
  });
  return (name) => expressions.some((expression) => expression.test(name));
}
