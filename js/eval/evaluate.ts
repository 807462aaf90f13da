import { CASE_FILE, loadCase, type Case } from "../cases/case.js";
import { FileError } from "../cases/errors.js";
import { StitchError, stitch, type Options, type Stage, type StitchResult } from "../index.js";
import { appearance, instability } from "./appearance.js";
import { compareHidden, cutReference, type Cut } from "./hidden.js";
import type { PerceptualDistance } from "./lpips.js";
import { UNMEASURED, type Group, type Values } from "./measures.js";
import { onPlane, type Mode } from "./modes.js";
import { checkTruth, truthError } from "./truth.js";

/** What is measured of one case in one mode. */
export interface Row extends Values {
  readonly case: string;
  readonly mode: string;
  readonly ms: Readonly<Partial<Record<Stage, number>>>;
  /** Code of the error that ended the case. */
  readonly failed?: string;
  readonly warnings: readonly string[];
}

/** A row, and what is behind it unless the case failed. */
export interface Evaluation {
  readonly row: Row;
  readonly input: Case | undefined;
  /** Of the whole photos; undefined where nothing asks for it. */
  readonly result: StitchResult | undefined;
}

/** What is asked of an evaluation, besides case and mode. */
export interface Task {
  /** Options on top of the mode's own. */
  readonly settings: Partial<Options>;
  /** Whether the photos are matched anew. */
  readonly ownMatches: boolean;
  readonly groups: ReadonlySet<Group>;
  /** Where `lpips` is among the groups. */
  readonly distance?: PerceptualDistance | undefined;
  /** Whether the pictures of the whole photos are wanted though nothing of them is measured. */
  readonly pictures: boolean;
}

/** Which part of each case's reference is hidden, by its folder: the same in every mode. */
const cuts = new Map<string, Promise<Cut | undefined>>();

/** Measures the case in `folder` on this thread. A case that cannot be read or stitched is a row that says so. */
export async function evaluate(
  folder: string,
  caseName: string,
  modeName: string,
  mode: Mode,
  task: Task,
): Promise<Evaluation> {
  let values: Values = UNMEASURED;
  let result: StitchResult | undefined;
  const warnings: string[] = [];
  try {
    const input = await loadCase(folder);
    if (input.truth)
      checkTruth(`${folder}/${CASE_FILE}`, input.truth, input.targetDepth, input.target);
    if (task.pictures || [...task.groups].some((group) => group !== "hidden")) {
      result = await stitched(input, mode, task);
      values = { ...values, ...(await measured(input, result, mode, task)) };
      warnings.push(...result.report.warnings.map(({ code }) => code));
    }
    if (task.groups.has("hidden")) {
      const hidden = await hiddenPart(folder, input, mode, task);
      if (hidden.lacks !== undefined) warnings.push(`hidden:${hidden.lacks}`);
      values = { ...values, ...hidden.values };
    }
    const row = { case: caseName, mode: modeName, ...values, ms: result?.times ?? {}, warnings };
    return { row, input, result };
  } catch (error) {
    const { code: failed } = known(error);
    const row = { case: caseName, mode: modeName, ...UNMEASURED, ms: {}, failed, warnings: [] };
    return { row, input: undefined, result: undefined };
  }
}

/** An error that a case may have; any other is thrown on. */
function known(error: unknown): StitchError | FileError {
  if (error instanceof StitchError || error instanceof FileError) return error;
  throw error;
}

function stitched(input: Case, mode: Mode, { settings, ownMatches }: Task): Promise<StitchResult> {
  const options = onPlane({
    ...mode.settings,
    ...settings,
    matches: ownMatches ? undefined : input.matches,
    targetDepth: mode.depth ? input.targetDepth : undefined,
    referenceDepth: mode.depth ? input.referenceDepth : undefined,
    outputDepth: true,
  });
  return stitch(input.target, input.reference, options);
}

async function measured(
  input: Case,
  result: StitchResult,
  mode: Mode,
  task: Task,
): Promise<Partial<Values>> {
  const { quality, report } = result;
  const { target, reference, truth, targetDepth: given } = input;
  const error =
    truth && given
      ? truthError(result.forward, result.targetDepth ?? given, truth, given, reference)
      : undefined;
  const { groups, distance, settings } = task;
  // Another seed is another sample of the matches.
  const seed = (settings.seed ?? 1) + 1;
  const again = groups.has("stability")
    ? await stitched(input, mode, { ...task, settings: { ...settings, seed } })
    : undefined;
  return {
    psnr_bbox: quality.psnrBbox,
    ssim_bbox: quality.ssimBbox,
    psnr_mask: quality.psnrMask,
    ssim_mask: quality.ssimMask,
    cover: quality.coverage,
    matches: report.matches,
    inliers: report.inliers,
    error_inside: error?.inside ?? null,
    error_outside: error?.outside ?? null,
    ...(groups.has("look") ? await appearance(target, reference, result) : {}),
    instability: again ? instability(result, again, reference) : null,
    lpips: groups.has("lpips") && distance ? await distance.measure(result, reference) : null,
  };
}

/** The measures of the hidden part, and why there are not all of them. */
async function hiddenPart(
  folder: string,
  input: Case,
  mode: Mode,
  task: Task,
): Promise<{ values: Partial<Values>; lacks?: string }> {
  try {
    const cutting = cuts.get(folder) ?? cutReference(input);
    cuts.set(folder, cutting);
    const cut = await cutting;
    if (!cut) return { values: {}, lacks: "no-overlap" };
    const found = await compareHidden(input, cut, mode, task);
    if (!found) return { values: { hidden_shown: 0 }, lacks: "not-shown" };
    const { psnr, ssim, shown, shift } = found;
    return {
      values: { hidden_psnr: psnr, hidden_ssim: ssim, hidden_shown: shown, hidden_shift: shift },
    };
  } catch (error) {
    return { values: { hidden_shown: 0 }, lacks: known(error).code };
  }
}
