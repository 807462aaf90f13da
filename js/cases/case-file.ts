import { FileError } from "./errors.js";
import { type Fields, isFields, isFinite, numbersOf, parseJson } from "./json.js";

/** How the values of a depth map file are interpreted: value × `scale` is depth (`metric`) or inverse depth (`inverse`). */
export interface DepthFormat {
  readonly kind: "inverse" | "metric";
  /** Default 1. */
  readonly scale: number;
  /** The value, before scaling, that means "unknown", or null. */
  readonly invalid: number | null;
}

/** The true map x' ~ h·(x, y, 1) + e·d(x) from target to reference, `h` in row-major order. */
export interface TrueMap {
  readonly h: readonly number[];
  readonly e: readonly number[];
}

/** The files of a pair of photos. */
export interface PairFiles {
  readonly target: string;
  readonly reference: string;
  /** Null for a pair without matches. */
  readonly matches: string | null;
  /** Null for a pair without depth. */
  readonly depth: DepthFiles | null;
}

/** One or two depth maps, and how their values are interpreted. */
export interface DepthFiles extends DepthFormat {
  readonly target: string | null;
  readonly reference: string | null;
}

/** The contents of a `case.json`. File names are relative to its folder. */
export interface CaseDescription extends PairFiles {
  /** The true map, for the depth maps of the case (`truth`) or for `truth_inverse_depth.npy` (`truth_map`). */
  readonly truth: (TrueMap & { readonly ownDepth: boolean }) | null;
}

/**
 * Reads a `case.json`. Unknown keys are ignored.
 *
 * @throws {FileError} `invalid-case`, naming the key; `path` is only for its message.
 */
export function parseCase(text: string, path: string): CaseDescription {
  const fail = (reason: string): never => {
    throw new FileError("invalid-case", path, reason);
  };
  const fields = (value: unknown, key: string): Fields =>
    isFields(value) ? value : fail(`${key} must be an object`);
  const string = (from: Fields, key: string): string => {
    const value = from[key];
    return typeof value === "string" && value !== "" ? value : fail(`"${key}" must be a file name`);
  };
  const optional = (from: Fields, key: string): string | null =>
    (from[key] ?? null) === null ? null : string(from, key);
  const numbers = (from: Fields, key: string, count: number): number[] =>
    numbersOf(from[key], count) ?? fail(`"${key}" must be ${count} numbers`);

  const depthFiles = (format: Fields): DepthFiles => {
    const target = optional(root, "target_depth");
    const reference = optional(root, "reference_depth");
    if (target === null && reference === null)
      fail('"depth" needs "target_depth" or "reference_depth"');
    return { ...parseFormat(format, fail), target, reference };
  };
  const root = fields(parseJson(text, path), "the file");
  const map = root.truth ?? root.truth_map ?? null;
  const truth = map === null ? null : fields(map, '"truth"');
  const format = root.depth ?? null;
  return {
    target: string(root, "target"),
    reference: string(root, "reference"),
    matches: optional(root, "matches"),
    depth: format === null ? null : depthFiles(fields(format, '"depth"')),
    truth: truth && {
      h: numbers(truth, "H_inf", 9),
      e: numbers(truth, "e_prime", 3),
      ownDepth: (root.truth ?? null) === null,
    },
  };
}

/** How depth values are to be read, by the `depth` of a case or of a set of photos. */
export function parseFormat(depth: Fields, fail: (reason: string) => never): DepthFormat {
  const { kind, scale = 1, invalid = null } = depth;
  if (kind !== "inverse" && kind !== "metric")
    return fail('"depth.kind" must be "inverse" or "metric"');
  if (!isFinite(scale) || scale <= 0) return fail('"depth.scale" must be a number above 0');
  if (invalid !== null && !isFinite(invalid))
    return fail('"depth.invalid" must be a number or null');
  return { kind, scale, invalid };
}
