import { loadDepth, loadPhoto } from "../cases/case.js";
import { inTurn } from "../cases/in-turn.js";
import { encodeGrayPng } from "../codecs.js";
import {
  crop,
  defaultOptions,
  stitchMany,
  version,
  type Options,
  type Size,
  type StitchManyResult,
} from "../index.js";
import { manyInputPaths, type Outputs, type StitchManyCommand } from "./arguments.js";
import { matchColours } from "./colours.js";
import { withDecoder } from "./decoding.js";
import { encodeImage, jsonBytes } from "./encode.js";
import { loadCameras } from "./given.js";
import type { Produced } from "./produced.js";
import { readingOf, type ProgressLine } from "./progress.js";
import { pixelsIn } from "./report.js";

/** Reads, stitches and encodes three photos or more. */
export async function stitchManyFiles(
  command: StitchManyCommand,
  line: ProgressLine,
): Promise<Produced> {
  const { photos, depth, cameras, reference, settings, outputs, quality, crop: part } = command;
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
  line.message("writing");
  const rect = part === "none" ? null : result.crop[part];
  const mosaic = rect ? crop(result.mosaic, rect) : result.mosaic;
  const exif = colours.exif[result.reference] ?? null;
  const metadata = { colourProfile: colours.colourProfile, exif };
  const encoded = await encodeImage(outputs.mosaic, mosaic, quality, metadata);
  const contents = new Map([[outputs.mosaic, encoded]]);
  if (outputs.voidMask) contents.set(outputs.voidMask, await encodeGrayPng(result.voidMask));
  if (outputs.report) {
    const options = { ...(await defaultOptions(settings.mode)), ...settings };
    const json = report(await version(), photos, sizes, options, outputs, result);
    contents.set(outputs.report, jsonBytes(json));
  }
  return {
    contents,
    warnings: [...colours.warnings, ...warnings(photos, result)],
    summary: summary(outputs, mosaic, result),
  };
}

/** The JSON of `--report`: everything in a result except images. */
function report(
  version: string,
  files: readonly string[],
  sizes: readonly { width: number; height: number }[],
  options: Options,
  outputs: Outputs,
  result: StitchManyResult,
): object {
  const { width, height } = result.mosaic;
  return {
    version,
    photos: result.photos.map(({ camera, ...photo }, i) => ({
      file: files[i],
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
    projection: result.projection,
    reference: files[result.reference],
    options,
    crop: result.crop,
    canvas: { width, height, offset: result.offset },
    voidPixels: pixelsIn(result.voidMask),
    warnings: result.warnings,
    times: result.times,
    outputs,
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

/** The summary in one line. */
function summary(outputs: Outputs, mosaic: Size, { photos }: StitchManyResult): string {
  const used = photos.filter((photo) => photo.used).length;
  return `${outputs.mosaic}: ${mosaic.width}×${mosaic.height}, ${used} of ${photos.length} photos`;
}
