import { CASE_FILE, loadCase, type Case } from "../cases/case.js";
import { FileError } from "../cases/errors.js";
import { StitchError, stitch, type Options, type Stage, type StitchResult } from "../index.js";
import type { Mode } from "./modes.js";
import { checkTruth, truthError, type ErrorSummary } from "./truth.js";

/** What is measured of one case in one mode; null where it could not be. */
export interface Row {
  readonly case: string;
  readonly mode: string;
  readonly psnr_bbox: number | null;
  readonly ssim_bbox: number | null;
  readonly psnr_mask: number | null;
  readonly ssim_mask: number | null;
  readonly cover: number | null;
  readonly matches: number | null;
  readonly inliers: number | null;
  /** Median and 90th percentile in pixels against the true map, where it leads into the reference. */
  readonly error_inside: ErrorSummary | null;
  readonly error_outside: ErrorSummary | null;
  readonly ms: Readonly<Partial<Record<Stage, number>>>;
  /** Code of the error that ended the case. */
  readonly failed?: string;
  readonly warnings: readonly string[];
}

/** A row, and the pictures behind it unless the case failed. */
export interface Evaluation {
  readonly row: Row;
  readonly result: StitchResult | undefined;
}

/** Stitches the case in `folder` on this thread. A case that cannot be read or stitched is a row that says so. */
export async function evaluate(
  folder: string,
  caseName: string,
  modeName: string,
  mode: Mode,
  { settings, ownMatches }: { settings: Partial<Options>; ownMatches: boolean },
): Promise<Evaluation> {
  try {
    const input = await loadCase(folder);
    if (input.truth)
      checkTruth(`${folder}/${CASE_FILE}`, input.truth, input.targetDepth, input.target);
    const result = await stitch(input.target, input.reference, {
      ...mode.settings,
      ...settings,
      matches: ownMatches ? undefined : input.matches,
      targetDepth: mode.depth ? input.targetDepth : undefined,
      referenceDepth: mode.depth ? input.referenceDepth : undefined,
      outputDepth: true,
      worker: false,
    });
    return { row: measured(caseName, modeName, input, result), result };
  } catch (error) {
    if (error instanceof StitchError || error instanceof FileError) {
      return { row: failure(caseName, modeName, error.code), result: undefined };
    }
    throw error;
  }
}

function measured(caseName: string, mode: string, input: Case, result: StitchResult): Row {
  const { quality, report, times } = result;
  const { truth, targetDepth: given } = input;
  const error =
    truth && given
      ? truthError(result.forward, result.targetDepth ?? given, truth, given, input.reference)
      : undefined;
  return {
    case: caseName,
    mode,
    psnr_bbox: quality.psnrBbox,
    ssim_bbox: quality.ssimBbox,
    psnr_mask: quality.psnrMask,
    ssim_mask: quality.ssimMask,
    cover: quality.coverage,
    matches: report.matches,
    inliers: report.inliers,
    error_inside: error?.inside ?? null,
    error_outside: error?.outside ?? null,
    ms: times,
    warnings: report.warnings.map(({ code }) => code),
  };
}

function failure(caseName: string, mode: string, code: string): Row {
  return {
    case: caseName,
    mode,
    psnr_bbox: null,
    ssim_bbox: null,
    psnr_mask: null,
    ssim_mask: null,
    cover: null,
    matches: null,
    inliers: null,
    error_inside: null,
    error_outside: null,
    ms: {},
    failed: code,
    warnings: [],
  };
}
