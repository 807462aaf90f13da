import { join } from "node:path";

import { CASE_FILE, loadDepth, loadPhoto } from "../../cases/case.js";
import { FileError } from "../../cases/errors.js";
import { readText } from "../../cases/files.js";
import type { DepthFormat } from "../../cases/case-file.js";
import type { DepthInput, ImageOutput } from "../../index.js";

/** A true camera: a point X of the world is at K(R·X + t), all matrices row by row. */
export interface TrueCamera {
  readonly K: readonly number[];
  readonly R: readonly number[];
  readonly t: readonly number[];
}

/** A set of photos, decoded. */
export interface PhotoSet {
  readonly photos: readonly ImageOutput[];
  /** Of every photo; undefined where they are not known. */
  readonly cameras: readonly TrueCamera[] | undefined;
  /** Exact depth of every photo, in the unit of the cameras; NaN where unknown. Undefined where it is not known. */
  readonly depths: readonly DepthInput[] | undefined;
}

interface Description {
  readonly photos: readonly string[];
  readonly depth: (DepthFormat & { readonly files: readonly string[] }) | null;
  readonly truth: { readonly cameras: readonly TrueCamera[] } | null;
}

/** Reads and decodes the set in `folder`. @throws {FileError} */
export async function loadSet(folder: string): Promise<PhotoSet> {
  const path = join(folder, CASE_FILE);
  const { photos, depth, truth } = parse(await readText(path), path);
  return {
    photos: await Promise.all(
      photos.map(async (file) => (await loadPhoto(join(folder, file))).image),
    ),
    cameras: truth?.cameras,
    depths:
      depth === null
        ? undefined
        : await Promise.all(depth.files.map((file) => loadDepth(join(folder, file), depth))),
  };
}

function parse(text: string, path: string): Description {
  const fail = (reason: string): never => {
    throw new FileError("invalid-case", path, reason);
  };
  const read = (): Partial<Description> => {
    try {
      return JSON.parse(text) as Partial<Description>;
    } catch (cause) {
      throw new FileError("invalid-case", path, "is not valid JSON", { cause });
    }
  };
  const { photos, depth = null, truth = null } = read();
  if (!Array.isArray(photos) || !photos.every((file) => typeof file === "string"))
    return fail('"photos" must be a list of file names');
  if (depth && depth.files?.length !== photos.length)
    return fail('"depth.files" must name a file for each photo');
  const cameras = truth?.cameras;
  const numbers = (values: unknown, count: number): boolean =>
    Array.isArray(values) && values.length === count && values.every(Number.isFinite);
  const known = ({ K, R, t }: TrueCamera): boolean =>
    numbers(K, 9) && numbers(R, 9) && numbers(t, 3);
  if (cameras && (cameras.length !== photos.length || !cameras.every(known)))
    return fail('"truth.cameras" must have K, R and t for each photo');
  return { photos, depth, truth };
}
