import { join, normalize, basename } from "node:path";

import {
  decodeDepth,
  decodeImage,
  readFocalLength,
  readMetadata,
  type DepthMap,
  type PhotoMetadata,
} from "../codecs.js";
import { StitchError, type DepthInput, type ImageOutput } from "../index.js";
import {
  parseCase,
  type CaseDescription,
  type DepthFormat,
  type PairFiles,
  type TrueMap,
} from "./case-file.js";
import { FileError } from "./errors.js";
import { readBytes, readText } from "./files.js";
import { inTurn } from "./in-turn.js";
import { parseMatches } from "./matches-file.js";
import { parseNpy, type NumericArray } from "./npy.js";

/** A decoded pair, ready for `stitch`. */
export interface Pair {
  readonly target: ImageOutput;
  readonly reference: ImageOutput;
  /** What the files say of target and reference besides their pixels. */
  readonly metadata: readonly [PhotoMetadata, PhotoMetadata];
  readonly matches: Float32Array | undefined;
  /** Scaled values, NaN where unknown. Models refer to depth in this unit. */
  readonly targetDepth: DepthInput | undefined;
  readonly referenceDepth: DepthInput | undefined;
}

/** The true geometry of a case. */
export interface Truth extends TrueMap {
  /** The true inverse depth of the target, unless the depth map of the case is exact. */
  readonly inverseDepth: NumericArray | undefined;
}

/** A decoded case. */
export interface Case extends Pair {
  readonly name: string;
  readonly truth: Truth | undefined;
}

/** Name of the file that describes a case. */
export const CASE_FILE = "case.json";

/** Decodes the bytes of files. */
export interface Decoder {
  readonly photo: (bytes: Uint8Array) => Promise<Photo>;
  readonly depth: (bytes: Uint8Array) => Promise<DepthMap>;
}

/** On the calling thread. */
export const decoder: Decoder = {
  photo: async (bytes) => {
    const [image, metadata] = [await decodeImage(bytes), await readMetadata(bytes)];
    const focalLength = metadata.exif && (await readFocalLength(metadata.exif, image));
    return { image, metadata, focalLength };
  },
  depth: decodeDepth,
};

/** Reads and decodes a pair, one file after another; `onFile` is called before each. @throws {FileError} */
export async function loadPair(
  files: PairFiles,
  onFile?: (path: string) => void,
  by: Decoder = decoder,
): Promise<Pair> {
  const { depth } = files;
  const read = inTurn(onFile);
  const readPhoto = (path: string) => read(path, () => loadPhoto(path, by));
  const readDepth = (path: string | null | undefined) =>
    depth && path ? read(path, () => loadDepth(path, depth, by)) : undefined;
  const [target, reference, matches, targetDepth, referenceDepth] = await Promise.all([
    readPhoto(files.target),
    readPhoto(files.reference),
    files.matches === null ? undefined : read(files.matches, loadMatches),
    readDepth(depth?.target),
    readDepth(depth?.reference),
  ]);
  return {
    target: target.image,
    reference: reference.image,
    metadata: [target.metadata, reference.metadata],
    matches,
    targetDepth,
    referenceDepth,
  };
}

/** The files of the case in `folder`. @throws {FileError} */
export async function caseFiles(folder: string): Promise<PairFiles> {
  return inFolder(folder, await describe(folder));
}

/** Reads and decodes the case in `folder`, including its true geometry. @throws {FileError} */
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

/** A decoded photo. */
export interface Photo {
  readonly image: ImageOutput;
  readonly metadata: PhotoMetadata;
  /** In pixels, by its EXIF data; null where they do not tell. */
  readonly focalLength: number | null;
}

/** Reads and decodes a photo. */
export async function loadPhoto(path: string, by: Decoder = decoder): Promise<Photo> {
  const bytes = await readBytes(path);
  return decoding(path, () => by.photo(bytes));
}

/** Reads matches from a CSV file. */
async function loadMatches(path: string): Promise<Float32Array> {
  return parseMatches(await readText(path), path);
}

/** Reads a depth map, scales its values and sets unknown ones to NaN. */
export async function loadDepth(
  path: string,
  format: DepthFormat,
  by: Decoder = decoder,
): Promise<DepthInput> {
  const bytes = await readBytes(path);
  const { data, width, height } = await decoding(path, () => by.depth(bytes));
  const scaled = Float32Array.from(data, (value) =>
    value === format.invalid ? NaN : value * format.scale,
  );
  return { data: scaled, width, height, kind: format.kind };
}

async function describe(folder: string): Promise<CaseDescription> {
  const path = join(folder, CASE_FILE);
  return parseCase(await readText(path), path);
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

/** Adds the path to errors of the decoder. */
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
