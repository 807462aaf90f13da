import type { ImageInput, Mask, StitchManyResult, StitchResult } from "../index.js";
import { instance } from "../instance.js";
import { compiler } from "../load.js";
import type { Values } from "./measures.js";
import * as glue from "./wasm/evaluation.js";

const evaluation = instance(glue);
const compile = compiler(() => new URL("./wasm/evaluation_bg.wasm", import.meta.url));

/** Fewer lines say nothing. */
const FEW_LINES = 5;

type Look = Pick<
  Values,
  | "border_voids"
  | "overlap_voids"
  | "seam_on_border"
  | "seam_length"
  | "visible_steps"
  | "steps_elsewhere"
  | "broken_inside"
  | "broken_across"
  | "broken_outside"
  | "bending"
>;

/** What a person sees of a mosaic. `result` needs the inverse depth that the target was warped with, if there is parallax. */
export async function appearance(
  target: ImageInput,
  reference: ImageInput,
  result: StitchResult,
): Promise<Look> {
  await evaluation.start(await compile());
  const seen = evaluation.call((raw) => raw.appearance(target, reference, result));
  return {
    border_voids: seen.borderVoids,
    overlap_voids: seen.overlapVoids,
    seam_on_border: seen.seamOnBorder,
    seam_length: seen.seamLength,
    visible_steps: seen.visibleSteps,
    steps_elsewhere: seen.stepsElsewhere,
    broken_inside: seen.brokenInside,
    broken_across: seen.brokenAcross,
    broken_outside: seen.brokenOutside,
    bending: seen.bending,
  };
}

/** Shares of all seams of a mosaic, and of all other places, with a step that shows; null of few. */
export async function visibleSteps({
  mosaic,
  labels,
}: Pick<StitchManyResult, "mosaic" | "labels">): Promise<{
  seam: number | null;
  elsewhere: number | null;
}> {
  await evaluation.start(await compile());
  return evaluation.call((raw) => raw.visibleSteps(mosaic, labels));
}

/** Share of the straight lines of all photos but the reference that the maps into it break; null of few. */
export async function brokenLines(
  photos: readonly ImageInput[],
  { photos: reports, reference }: Pick<StitchManyResult, "photos" | "reference">,
): Promise<number | null> {
  await evaluation.start(await compile());
  let [lines, broken] = [0, 0];
  photos.forEach((photo, i) => {
    const { forward, inverseDepth, undistorted } = reports[i] ?? {};
    if (i === reference || !forward) return;
    const shown = undistorted ?? photo;
    const found = evaluation.call((raw) => raw.brokenLines(shown, forward, inverseDepth));
    [lines, broken] = [lines + found.lines, broken + found.broken];
  });
  return lines < FEW_LINES ? null : broken / lines;
}

/** A picture on a canvas, and where the reference lies there. */
export interface Placed {
  readonly mosaic: Pick<ImageInput, "data" | "width" | "height">;
  readonly offset: { readonly x: number; readonly y: number };
}

/** How different two mosaics are where the reference does not show: 1 less intersection over union; 0 if neither shows. */
export function instability(
  a: Placed,
  b: Placed,
  reference: Pick<Mask, "width" | "height">,
): number {
  const shown = ({ mosaic, offset }: Placed, x: number, y: number): boolean => {
    const [column, row] = [x + offset.x, y + offset.y];
    const inside = column >= 0 && row >= 0 && column < mosaic.width && row < mosaic.height;
    return inside && mosaic.data[4 * (row * mosaic.width + column) + 3] !== 0;
  };
  const left = Math.min(-a.offset.x, -b.offset.x);
  const top = Math.min(-a.offset.y, -b.offset.y);
  const right = Math.max(a.mosaic.width - a.offset.x, b.mosaic.width - b.offset.x);
  const bottom = Math.max(a.mosaic.height - a.offset.y, b.mosaic.height - b.offset.y);
  let [both, either] = [0, 0];
  for (let y = top; y < bottom; y++) {
    for (let x = left; x < right; x++) {
      if (x >= 0 && y >= 0 && x < reference.width && y < reference.height) continue;
      const [inA, inB] = [shown(a, x, y), shown(b, x, y)];
      both += inA && inB ? 1 : 0;
      either += inA || inB ? 1 : 0;
    }
  }
  return either === 0 ? 0 : 1 - both / either;
}
