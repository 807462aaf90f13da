import { join, normalize, basename } from "node:path";

import { decodeDepth, decodeImage } from "../codecs.js";
import { StitchError, type DepthInput, type ImageOutput } from "../index.js";
import {
  parseDescription,
  type CaseDescription,
  type DepthFormat,
  type TrueMap,
} from "./description.js";
import { FileError } from "./errors.js";
import { readBytes, readText } from "./files.js";
import { parseMatches } from "./matches.js";
import { parseNpy, type NumericArray } from "./npy.js";

/** The files of a pair of photos. */
export interface PairFiles {
  readonly target: string;
  readonly reference: string;
  /** Null: features are detected and matched. */
  readonly matches: string | null;
  /** The depth maps there are and how to read them, or null for a pair without depth. */
  readonly depth: DepthFiles | null;
}

/** Depth maps of one photo or of both. */
export interface DepthFiles extends DepthFormat {
  readonly target: string | null;
  readonly reference: string | null;
}

/** A decoded pair, ready for `stitch`. */
export interface Pair {
  readonly target: ImageOutput;
  readonly reference: ImageOutput;
  readonly matches: Float32Array | undefined;
  /** Values already scaled, holes NaN: the geometry's d is in this unit. */
  readonly targetDepth: DepthInput | undefined;
  readonly referenceDepth: DepthInput | undefined;
}

/** What is known of the true geometry. */
export interface Truth extends TrueMap {
  /** The true inverse depth of the target, where it is not the depth given. */
  readonly inverseDepth: NumericArray | undefined;
}

/** A pair from a case folder. */
export interface Case extends Pair {
  readonly name: string;
  readonly truth: Truth | undefined;
}

/** The file that describes a case. */
export const CASE_FILE = "case.json";

/** Reads and decodes a pair. Photos keep 8 bits, depth maps their 8 or 16. */
export async function loadPair(files: PairFiles): Promise<Pair> {
  const { depth } = files;
  const [target, reference, matches, targetDepth, referenceDepth] = await Promise.all([
    loadImage(files.target),
    loadImage(files.reference),
    files.matches === null ? undefined : loadMatches(files.matches),
    depth?.target ? loadDepth(depth.target, depth) : undefined,
    depth?.reference ? loadDepth(depth.reference, depth) : undefined,
  ]);
  return { target, reference, matches, targetDepth, referenceDepth };
}

/** The files that the case in `folder` names. */
export async function caseFiles(folder: string): Promise<PairFiles> {
  return inFolder(folder, await describe(folder));
}

/** Reads and decodes the case in `folder`, its truth included. */
export async function loadCase(folder: string): Promise<Case> {
  const description = await describe(folder);
  const { truth } = description;
  const truthFile = join(folder, "truth_inverse_depth.npy");
  const [pair, inverseDepth] = await Promise.all([
    loadPair(inFolder(folder, description)),
    truth?.ownDepth ? readBytes(truthFile).then((bytes) => parseNpy(bytes, truthFile)) : undefined,
  ]);
  return {
    name: basename(normalize(join(folder, "."))),
    ...pair,
    truth: truth ? { ...truth, inverseDepth } : undefined,
  };
}

/** Reads and decodes a photo. */
export async function loadImage(path: string): Promise<ImageOutput> {
  const bytes = await readBytes(path);
  return decoding(path, () => decodeImage(bytes));
}

/** Reads the matches of a CSV file. */
export async function loadMatches(path: string): Promise<Float32Array> {
  return parseMatches(await readText(path), path);
}

/** Reads a depth map, marks its holes with NaN and scales the other values. */
export async function loadDepth(path: string, format: DepthFormat): Promise<DepthInput> {
  const bytes = await readBytes(path);
  const { data, width, height } = await decoding(path, () => decodeDepth(bytes));
  const scaled = Float32Array.from(data, (value) =>
    value === format.invalid ? NaN : value * format.scale,
  );
  return { data: scaled, width, height, kind: format.kind };
}

async function describe(folder: string): Promise<CaseDescription> {
  const path = join(folder, CASE_FILE);
  return parseDescription(await readText(path), path);
}

function inFolder(folder: string, description: PairFiles): PairFiles {
  const { target, reference, matches, depth } = description;
  const inside = (name: string | null): string | null => name && join(folder, name);
  return {
    target: join(folder, target),
    reference: join(folder, reference),
    matches: inside(matches),
    depth: depth && {
      ...depth,
      target: inside(depth.target),
      reference: inside(depth.reference),
    },
  };
}

/** Puts the file's name into what the decoder says. */
async function decoding<T>(path: string, decode: () => Promise<T>): Promise<T> {
  try {
    return await decode();
  } catch (error) {
    if (!(error instanceof StitchError)) throw error;
    const code =
      error.code === "decode-failed" || error.code === "too-large" ? error.code : undefined;
    if (code === undefined) throw error;
    throw new FileError(code, path, error.message, { cause: error });
  }
}
