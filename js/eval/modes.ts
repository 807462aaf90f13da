import type { Options } from "../index.js";

/** One way of stitching that is evaluated. */
export interface Mode {
  readonly settings: Partial<Options>;
  /** Whether the depth maps of the case are used. */
  readonly depth: boolean;
}

/** Everything of the published method, spelled out so that it stays when defaults move on. */
const PAPER: Partial<Options> = {
  robustFit: "depth",
  threshold: "paper",
  warpMode: "optimal",
  maxTrials: 2000,
  confidence: 0.99,
  gridColumns: 0,
  gridRows: 0,
  holes: "nearest",
  voidDistance: 0.01,
  stretchLimit: 2,
};

const ablation = (change: Partial<Options>): Mode => ({
  settings: { ...PAPER, ...change },
  depth: true,
});

/**
 * The modes by name. The ablations change one thing of `paper`; the models of the two robust fits are still fitted with
 * depth, on the inliers that the homographies chose. `baseline` is what one does without depth.
 */
export const MODES: ReadonlyMap<string, Mode> = new Map([
  ["baseline", { settings: {}, depth: false }],
  ["homography", ablation({ robustFit: "homography" })],
  ["multi-homography", ablation({ robustFit: "multi-homography" })],
  ["forward", ablation({ warpMode: "forward" })],
  ["backward", ablation({ warpMode: "backward" })],
  ["backward+void", ablation({ warpMode: "backward+void" })],
  ["paper", ablation({})],
  ["default", { settings: {}, depth: true }],
]);

/** Modes of the design that this version does not have. */
export const LATER_MODES: readonly string[] = ["calibrated", "refined", "two-view"];
