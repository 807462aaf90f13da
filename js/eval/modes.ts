import type { Options } from "../index.js";

/** One way of stitching that is evaluated. */
export interface Mode {
  readonly settings: Partial<Options>;
  /** Whether the depth maps of the case are used. */
  readonly depth: boolean;
}

/** Options of a stitch that is measured: on the reference's plane, where measures are taken, whatever else they say. */
export function onPlane<T extends object>(options: T) {
  return { ...options, projection: "plane", worker: false } as const;
}

const PAPER: Partial<Options> = { mode: "paper" };

const ablation = (change: Partial<Options>): Mode => ({
  settings: { ...PAPER, ...change },
  depth: true,
});

/**
 * The modes by name. The ablations change one option of `paper`; with the other two robust fits, the depth model is still
 * fitted to the inliers that the homographies select. `baseline` is a homography without depth. `calibrated` forces the
 * calibrated model on `default`, without refinement; `refined` is its counterpart: epipolar refinement of the free model,
 * without tracked points. `two-view` ignores the depth maps of the case.
 */
export const MODES: ReadonlyMap<string, Mode> = new Map<string, Mode>([
  ["baseline", { settings: { withoutDepth: "homography" }, depth: false }],
  ["homography", ablation({ robustFit: "homography" })],
  ["multi-homography", ablation({ robustFit: "multi-homography" })],
  ["forward", ablation({ warpMode: "forward" })],
  ["backward", ablation({ warpMode: "backward" })],
  ["backward+void", ablation({ warpMode: "backward+void" })],
  ["paper", ablation({})],
  ["calibrated", { settings: { calibration: "always", refinement: "none" }, depth: true }],
  ["refined", { settings: { calibration: "off", refinement: "epipolar" }, depth: true }],
  ["two-view", { settings: { withoutDepth: "two-view" }, depth: false }],
  ["default", { settings: {}, depth: true }],
]);
