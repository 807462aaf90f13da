import type { Options } from "depthstitch";
import type { Outcome } from "../state.js";
import type { Job } from "./job.js";

/** A method to compare with. */
export interface Method {
  readonly id: string;
  readonly label: string;
  /** A short explanation. */
  readonly hint: string;
  readonly options: Partial<Options>;
  /** Whether depth maps are passed. */
  readonly depth: boolean;
}

const paper = (change: Partial<Options>): Partial<Options> => ({ mode: "paper", ...change });

/** From a homography to the complete method of the paper. */
export const methods: readonly Method[] = [
  {
    id: "homography",
    label: "Homography",
    hint: "one plane for the whole scene, as in panorama stitching",
    options: { withoutDepth: "homography" },
    depth: false,
  },
  {
    id: "homography-fit",
    label: "Inliers of one homography",
    hint: "depth model fitted to the inliers of one homography",
    options: paper({ robustFit: "homography" }),
    depth: true,
  },
  {
    id: "multi-homography-fit",
    label: "Inliers of several homographies",
    hint: "depth model fitted to the inliers of several homographies",
    options: paper({ robustFit: "multi-homography" }),
    depth: true,
  },
  {
    id: "forward",
    label: "Forward warp",
    hint: "each pixel is moved to the nearest pixel, which leaves gaps",
    options: paper({ warpMode: "forward" }),
    depth: true,
  },
  {
    id: "backward",
    label: "Backward warp",
    hint: "no gaps, but occluded areas are smeared",
    options: paper({ warpMode: "backward" }),
    depth: true,
  },
  {
    id: "backward+void",
    label: "Backward warp with void recovery",
    hint: "occluded areas are left empty",
    options: paper({ warpMode: "backward+void" }),
    depth: true,
  },
  {
    id: "paper",
    label: "The complete method of the paper",
    hint: "overlapping surfaces are resolved",
    options: paper({}),
    depth: true,
  },
];

/**
 * The job of a method on the photos of a result, with the same matches and the same depth, given or estimated.
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

/** Whether a method needs depth that the result does not have. */
export function isDegenerate(method: Method, { job, result }: Outcome): boolean {
  return method.depth && !job.targetDepth && !result.targetDepth;
}
