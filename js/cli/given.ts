import { basename } from "node:path";

import { FileError } from "../cases/errors.js";
import { readText } from "../cases/files.js";
import { isFields, isFinite, numbersOf, parseJson } from "../cases/json.js";
import type { PhotoInput, Size } from "../index.js";

/** The camera of one photo, as `stitchMany` takes it. */
export type GivenCamera = Required<Pick<PhotoInput, "camera" | "focalLength">>;

/** The cameras of all photos, and the distortion of their lens, if the file says it. */
export interface GivenCameras {
  readonly cameras: readonly GivenCamera[];
  readonly distortion: number | undefined;
  /**
   * Checks that the photos are as large as the file says, where it does: focal lengths are in pixels.
   *
   * @throws {FileError} `invalid-case`.
   */
  checkSizes(photos: readonly Size[]): void;
}

/**
 * Reads the cameras of all photos from JSON: `{ "photos": [{ "file", "width", "height", "focalLength", "camera": { "rotation", "translation" } }], "distortion" }`,
 * as `--report` writes it; the rest is ignored, and "file", "width", "height" and "distortion" may be missing.
 *
 * @throws {FileError} `invalid-case`.
 */
export async function loadCameras(path: string, photos: readonly string[]): Promise<GivenCameras> {
  const fail = (reason: string): never => {
    throw new FileError("invalid-case", path, reason);
  };
  const root = parseJson(await readText(path), path);
  const { photos: list, distortion } = isFields(root) ? root : {};
  if (!Array.isArray(list) || list.length !== photos.length)
    return fail(`"photos" must be a list of ${photos.length}, one for each photo`);
  if (distortion !== undefined && !isFinite(distortion))
    return fail(`"distortion" must be a number`);
  const cameras = photos.map((photo, i) => {
    const name = `"photos[${i}]"`;
    const entry: unknown = list[i];
    if (!isFields(entry)) return fail(`${name} must be an object`);
    const { file, focalLength, camera } = entry;
    // In another order all cameras would be wrong.
    if (typeof file === "string" && basename(file) !== basename(photo))
      return fail(`${name} is of ${file}, the photo at this place is ${photo}`);
    if (!isFields(camera)) return fail(`${name} has no camera`);
    const numbers = (key: string, count: number): Float64Array<ArrayBuffer> => {
      const found = numbersOf(camera[key], count);
      return Float64Array.from(found ?? fail(`${name}: "${key}" must be ${count} numbers`));
    };
    if (!isFinite(focalLength)) return fail(`${name}: "focalLength" must be a number`);
    return {
      focalLength,
      camera: { rotation: numbers("rotation", 9), translation: numbers("translation", 3) },
    };
  });
  const checkSizes = (sizes: readonly Size[]): void =>
    sizes.forEach((size, i) => {
      const entry: unknown = list[i];
      for (const side of ["width", "height"] as const) {
        const said = isFields(entry) ? entry[side] : undefined;
        if (said !== undefined && said !== size[side])
          fail(
            `"photos[${i}]": "${side}" is ${JSON.stringify(said)}, that of ${photos[i]} is ${size[side]}`,
          );
      }
    });
  return { cameras, distortion, checkSizes };
}
