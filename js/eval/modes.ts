import type { Options } from "../index.js";

/** One way of stitching that is evaluated. */
export interface Mode {
  readonly settings: Partial<Options>;
  /** Whether the depth maps of the case are used. */
  readonly depth: boolean;
}

const PAPER: Partial<Options> = { mode: "paper" };

const ablation = (change: Partial<Options>): Mode => ({
  settings: { ...PAPER, ...change },
  depth: true,
});

/**
 * The modes by name. The ablations change one thing of `paper`; the models of the two robust fits are still fitted with
 * depth, on the inliers that the homographies chose. `baseline` is what one does without depth. `calibrated` adds the
 * calibrated geometry to the fit of `default`, `refined` the refinement, `two-view` ignores the depth maps of the case.
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
  ["refined", { settings: { refinement: "epipolar" }, depth: true }],
  ["two-view", { settings: { withoutDepth: "two-view" }, depth: false }],
  ["default", { settings: {}, depth: true }],
]);
