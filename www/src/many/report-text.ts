import type { PhotoPair, PhotoReport, StitchManyResult } from "depthstitch";
import type { ManyOutcome } from "../state.js";
import { count, percent, pixels, seconds } from "../text/numbers.js";
import { sizeOf } from "../text/report.js";

export function usedCount({ result }: ManyOutcome): number {
  return result.photos.filter(({ used }) => used).length;
}

/** Why a photo was left out, and what can be done; empty for one that is in the picture. */
export function whyLeftOut(outcome: ManyOutcome, index: number): string {
  const code = outcome.result.photos[index]?.code ?? "used";
  return code === "used" ? "" : `Left out. ${reasons[code](outcome, index)}`;
}

const reasons: Readonly<
  Record<Exclude<PhotoReport["code"], "used">, (outcome: ManyOutcome, index: number) => string>
> = {
  "no-matches": () => "No common points with the other photos were found.",
  "other-group": (outcome, index) => {
    const others = linkedTo(outcome, index);
    return others.length > 0
      ? `It has points in common with ${others.join(", ")} only, and these with no others.`
      : "It belongs to photos that have no points in common with the others.";
  },
  "no-pose": () =>
    "It has points in common with others, but they do not tell where it was taken. More overlap would help.",
  "too-oblique": () =>
    "It looks so far to the side that it would be stretched out of shape. Another reference photo may show it.",
  "not-visible": () =>
    "Nothing of it can be seen from the reference photo. Another reference photo may show it.",
};

/** The names of the photos that a photo is connected with. */
function linkedTo({ result, photos }: ManyOutcome, index: number): string[] {
  return result.pairs
    .filter((pair) => pair.linked && pair.photos.includes(index))
    .flatMap((pair) => pair.photos.filter((photo) => photo !== index))
    .map((photo) => photos[photo]?.file.name ?? "");
}

const geometryText: Readonly<
  Record<StitchManyResult["geometry"], { name: string; under: string; sentence: string }>
> = {
  cameras: {
    name: "Cameras",
    under: "in different places",
    sentence:
      "The photos were taken from different places. Their cameras and the depth of each photo were estimated together, and every photo is shown as the camera of the reference would see it.",
  },
  rotations: {
    name: "Rotations",
    under: "of a camera in one place",
    sentence:
      "The camera only turned between the photos, so there is no parallax, and depth is not needed.",
  },
  homographies: {
    name: "Homographies",
    under: "of a flat scene",
    sentence:
      "The photos are aligned by homographies, which are exact for a flat scene. Otherwise nearby objects are displaced.",
  },
};

/** The key figures: name, value, and a line under it. */
export function manyFigures(outcome: ManyOutcome): readonly (readonly [string, string, string])[] {
  const { result } = outcome;
  const used = usedCount(outcome);
  const { name, under } = geometryText[result.geometry];
  const linked = result.pairs.filter((pair) => pair.linked).length;
  const errors = result.photos.flatMap(({ error }) => (error === null ? [] : [error]));
  const error = errors.sort((a, b) => a - b)[Math.floor(errors.length / 2)];
  return [
    ["Photos", `${used} of ${result.photos.length}`, "in the picture"],
    ["Geometry", name, under],
    ["Pairs", `${linked} of ${result.pairs.length}`, "have enough points in common"],
    ["Error", error === undefined ? "–" : pixels(error), "median, of the matches"],
  ];
}

/** The report in sentences. */
export function manyParagraphs(outcome: ManyOutcome): string[] {
  const { result, photos, elapsed } = outcome;
  const { mosaic, voids, offset } = result;
  const share = percent(voids / (mosaic.width * mosaic.height));
  return [
    geometryText[result.geometry].sentence,
    ...distortionText(result.distortion),
    `The mosaic has ${mosaic.width} × ${mosaic.height} pixels; the reference, ${photos[result.reference]?.file.name ?? ""}, starts at ${offset.x}, ${offset.y}. ` +
      (voids > 0
        ? `${count(voids, "pixel", "pixels")} (${share}) inside the outline of the photos ${voids === 1 ? "is" : "are"} visible in none of them.`
        : "There are no gaps inside the outline of the photos."),
    `Total time: ${seconds(elapsed)}, in a worker of this page.`,
  ];
}

/** What the lens does to straight lines, if anything. */
function distortionText(distortion: number): string[] {
  if (distortion === 0) return [];
  const [bent, shape] = distortion < 0 ? ["outwards", "barrel"] : ["inwards", "pincushion"];
  return [
    `The lens bends straight lines ${bent} (${shape} distortion, k = ${distortion.toFixed(3)}); the photos are shown without that.`,
  ];
}

/** Pairs of photos, those with the most points in common first. */
export function sortedPairs({ result }: ManyOutcome): readonly PhotoPair[] {
  return [...result.pairs].sort((a, b) => b.inliers - a.inliers || b.matches - a.matches);
}

/** The report as JSON: everything in a result except images. */
export function manyReportJson(
  { result, photos, settings, elapsed }: ManyOutcome,
  version: string,
): string {
  const { mosaic, voids, offset, scale, reference, geometry, distortion } = result;
  const { projection, pairs, crop, warnings, times } = result;
  const value = {
    version,
    photos: result.photos.map(({ camera, ...report }, index) => {
      const { file, content } = photos[index] ?? {};
      return {
        file: file?.name ?? null,
        ...(content && sizeOf(content)),
        ...report,
        camera: camera && {
          rotation: [...camera.rotation],
          translation: [...camera.translation],
        },
      };
    }),
    pairs,
    geometry,
    distortion,
    projection,
    reference: photos[reference]?.file.name ?? null,
    scale,
    fillMethod: settings.fillMethod,
    options: settings.options,
    crop,
    canvas: {
      width: mosaic.width,
      height: mosaic.height,
      offset,
      voids,
    },
    warnings,
    times,
    elapsed,
  };
  return `${JSON.stringify(value, null, 2)}\n`;
}
