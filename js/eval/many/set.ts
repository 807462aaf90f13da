import { join } from "node:path";

import { CASE_FILE, loadDepth, loadPhoto } from "../../cases/case.js";
import { FileError } from "../../cases/errors.js";
import { readText } from "../../cases/files.js";
import { parseFormat, type DepthFormat } from "../../cases/case-file.js";
import { isFields, numbersOf, parseJson, type Fields } from "../../cases/json.js";
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
  readonly cameras: readonly TrueCamera[] | undefined;
}

/** Reads and decodes the set in `folder`. @throws {FileError} */
export async function loadSet(folder: string): Promise<PhotoSet> {
  const path = join(folder, CASE_FILE);
  const { photos, depth, cameras } = parse(await readText(path), path);
  return {
    photos: await Promise.all(
      photos.map(async (file) => (await loadPhoto(join(folder, file))).image),
    ),
    cameras,
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
  const fields = (value: unknown): Fields => (isFields(value) ? value : {});
  const root = fields(parseJson(text, path));
  const { photos, depth = null, truth = null } = root;
  if (!areNames(photos)) return fail('"photos" must be a list of file names');
  const depthOf = (format: Fields): Description["depth"] => {
    const { files } = format;
    if (!areNames(files) || files.length !== photos.length)
      return fail('"depth.files" must name a file for each photo');
    return { ...parseFormat(format, fail), files };
  };
  const { cameras = null } = fields(truth);
  return {
    photos,
    depth: depth === null ? null : depthOf(fields(depth)),
    cameras:
      cameras === null
        ? undefined
        : (camerasOf(cameras, photos.length) ??
          fail('"truth.cameras" must have K, R and t for each photo')),
  };
}

function areNames(value: unknown): value is string[] {
  return Array.isArray(value) && value.every((name) => typeof name === "string");
}

function camerasOf(value: unknown, count: number): TrueCamera[] | undefined {
  if (!Array.isArray(value) || value.length !== count) return undefined;
  const known = value.flatMap((camera: unknown) => {
    if (!isFields(camera)) return [];
    const [K, R, t] = [numbersOf(camera.K, 9), numbersOf(camera.R, 9), numbersOf(camera.t, 3)];
    return K && R && t ? [{ K, R, t }] : [];
  });
  return known.length === count ? known : undefined;
}
