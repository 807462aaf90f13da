import { FileError } from "../../cases/errors.js";
import { StitchError, stitchMany, type ImageOutput, type StitchManyResult } from "../../index.js";
import { brokenLines, visibleSteps } from "../appearance.js";
import type { Row, Task } from "../evaluate.js";
import { UNMEASURED, type Values } from "../measures.js";
import { cameraErrors } from "./cameras.js";
import { landingErrors } from "./landing.js";
import { compareLeftOut } from "./left-out.js";
import { loadSet, type PhotoSet } from "./set.js";

/** The mode that rows and floors of sets have. */
export const MANY = "many";

/** A row, and what is behind it unless the set failed. */
export interface SetEvaluation {
  readonly row: Row;
  readonly photos: readonly ImageOutput[];
  readonly result: StitchManyResult | undefined;
}

/** Measures the set in `folder` on this thread. A set that cannot be read or stitched is a row that says so. */
export async function evaluateSet(
  folder: string,
  name: string,
  { settings, groups }: Pick<Task, "settings" | "groups">,
): Promise<SetEvaluation> {
  const base = { case: name, mode: MANY, ...UNMEASURED };
  try {
    const set = await loadSet(folder);
    const options = { ...settings, outputDepth: true, worker: false } as const;
    const result = await stitchMany(set.photos, options);
    const left = groups.has("leaveOut") ? await compareLeftOut(set.photos, settings) : undefined;
    const row = {
      ...base,
      ...(await measured(set, result)),
      left_out_ssim: left?.ssim ?? null,
      left_out_shown: left?.share ?? null,
      left_out_shift: left?.shift ?? null,
      ms: result.times,
      warnings: [
        result.geometry,
        result.projection,
        ...result.photos.flatMap(({ code }, i) => (code === "used" ? [] : [`${i}:${code}`])),
        ...result.warnings.map(({ code }) => code),
      ],
    };
    return { row, photos: set.photos, result };
  } catch (error) {
    if (!(error instanceof StitchError || error instanceof FileError)) throw error;
    return {
      row: { ...base, ms: {}, failed: error.code, warnings: [] },
      photos: [],
      result: undefined,
    };
  }
}

async function measured(
  { photos, cameras, depths }: PhotoSet,
  result: StitchManyResult,
): Promise<Partial<Values>> {
  const used = result.photos.filter((photo) => photo.used).length;
  const found = cameras ? cameraErrors(result.photos, cameras) : null;
  const landing = cameras && depths ? landingErrors(result, cameras, depths) : undefined;
  const steps = await visibleSteps(result);
  return {
    photos_used: used,
    photos_missing: photos.length - used,
    rotation_error: found?.rotation ?? null,
    direction_error: found?.direction ?? null,
    focal_error: found?.focal ?? null,
    landing_shared: landing?.inside ?? null,
    landing_alone: landing?.outside ?? null,
    all_steps: steps.seam,
    all_steps_elsewhere: steps.elsewhere,
    all_broken: await brokenLines(photos, result),
  };
}
