import { loadDepth, loadPhoto } from "../cases/case.js";
import { inTurn } from "../cases/in-turn.js";
import { stitchMany, type StitchManyResult } from "../index.js";
import { manyInputPaths, type StitchManyCommand } from "./arguments.js";
import { matchColours } from "./colours.js";
import { withDecoder } from "./decoding.js";
import { loadCameras } from "./given.js";
import type { Stitched } from "./produced.js";
import { readingOf, type ProgressLine } from "./progress.js";

/** Reads and stitches three photos or more. */
export async function stitchManyFiles(
  command: StitchManyCommand,
  line: ProgressLine,
): Promise<Stitched> {
  const { photos, depth, cameras, reference, settings } = command;
  const read = inTurn(readingOf(manyInputPaths(command), line));
  const known = cameras ? await read(cameras, (path) => loadCameras(path, photos)) : undefined;
  // Without a reference the colours are those of the first photo, as it is chosen later.
  const [decoded, depths] = await withDecoder((by) => {
    const images = photos.map((path) => read(path, () => loadPhoto(path, by)));
    const maps = depth?.files.map((path) => path && read(path, () => loadDepth(path, depth, by)));
    return Promise.all([Promise.all(images), Promise.all(maps ?? [])]);
  });
  const sizes = decoded.map(({ image: { width, height } }) => ({ width, height }));
  known?.checkSizes(sizes);
  const colours = await matchColours(photos, decoded, reference ?? 0);
  const images = colours.images.map((image, i) => {
    const map = depths[i];
    const focalLength = settings.focalLength === undefined ? decoded[i]?.focalLength : null;
    return { ...image, focalLength, ...known?.cameras[i], ...(map && { depth: map }) };
  });
  const call = { onProgress: line.show, workers: command.workers };
  const distortion = command.distortion ?? known?.distortion;
  // The photos are not needed any more here.
  const result = await stitchMany(images, {
    ...settings,
    reference,
    distortion,
    ...call,
    transfer: true,
  });
  const used = result.photos.filter((photo) => photo.used).length;
  return {
    result,
    colours,
    reference: result.reference,
    report: {
      photos: result.photos.map(({ camera, ...photo }, i) => ({
        file: photos[i],
        ...sizes[i],
        ...photo,
        camera: camera && {
          rotation: Array.from(camera.rotation),
          translation: Array.from(camera.translation),
        },
      })),
      pairs: result.pairs,
      geometry: result.geometry,
      distortion: result.distortion,
      reference: photos[result.reference],
      scale: result.scale,
      warnings: result.warnings,
    },
    warnings: warnings(photos, result),
    summary: `${used} of ${photos.length} photos`,
  };
}

const REASONS: Readonly<Record<string, string>> = {
  "no-matches": "it matches none of the others",
  "other-group": "it matches only photos that do not match the others",
  "no-pose": "its matches do not determine its pose",
  "too-oblique": "it looks too far to the side",
  "not-visible": "nothing of it can be seen from the reference",
};

/** A line for every photo that was left out, and the warnings of the whole. */
function warnings(files: readonly string[], { photos, warnings }: StitchManyResult): string[] {
  const left = photos.flatMap(({ code }, i) =>
    code === "used" ? [] : [`${code}: ${files[i]} was left out: ${REASONS[code] ?? code}`],
  );
  return [...left, ...warnings.map(({ code, message }) => `${code}: ${message}`)];
}
