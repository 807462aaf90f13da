import type { Options } from "depthstitch";
import type { Outcome } from "../state.js";
import type { Job } from "./job.js";

/** A way of stitching to compare with. */
export interface Method {
  readonly id: string;
  readonly label: string;
  /** What is different about it, in a few words. */
  readonly hint: string;
  readonly options: Partial<Options>;
  /** Whether it uses depth; without, there is nothing but a homography. */
  readonly depth: boolean;
}

const paper = (change: Partial<Options>): Partial<Options> => ({ mode: "paper", ...change });

/** From what one does without depth to all of the paper; the last one is the result itself. */
export const methods: readonly Method[] = [
  {
    id: "homography",
    label: "Homography",
    hint: "one plane for everything, as panoramas are made",
    options: { withoutDepth: "homography" },
    depth: false,
  },
  {
    id: "homography-fit",
    label: "Inliers by one homography",
    hint: "depth, but fitted on what one plane agrees with",
    options: paper({ robustFit: "homography" }),
    depth: true,
  },
  {
    id: "multi-homography-fit",
    label: "Inliers by several homographies",
    hint: "depth, fitted on what several planes agree with",
    options: paper({ robustFit: "multi-homography" }),
    depth: true,
  },
  {
    id: "forward",
    label: "Forward warp",
    hint: "each pixel to the nearest place, with gaps between",
    options: paper({ warpMode: "forward" }),
    depth: true,
  },
  {
    id: "backward",
    label: "Backward warp",
    hint: "no gaps, but what is hidden is smeared",
    options: paper({ warpMode: "backward" }),
    depth: true,
  },
  {
    id: "backward+void",
    label: "Backward warp, voids found",
    hint: "what is hidden is left out",
    options: paper({ warpMode: "backward+void" }),
    depth: true,
  },
  {
    id: "paper",
    label: "The paper, complete",
    hint: "where surfaces overlap, the better one",
    options: paper({}),
    depth: true,
  },
];

/**
 * The job of a method on the photos of a result: with the same matches, and with the depth that the result was made with,
 * given or found.
 */
export function jobFor(method: Method, { job, result }: Outcome): Job {
  const { target, reference } = job;
  const targetDepth = job.targetDepth ?? result.targetDepth;
  const referenceDepth = job.referenceDepth ?? result.referenceDepth;
  const depths = {
    ...(targetDepth && { targetDepth }),
    ...(referenceDepth && { referenceDepth }),
  };
  return {
    target,
    reference,
    matches: result.matches,
    ...(method.depth && depths),
    options: method.options,
  };
}

export function isDegenerate(method: Method, { job, result }: Outcome): boolean {
  return method.depth && !job.targetDepth && !result.targetDepth;
}
