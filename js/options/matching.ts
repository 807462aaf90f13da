// Features and their matches.
import type { OptionSpec } from "../option-spec.js";

export const matching = {
  matchSize: {
    group: "matching",
    type: "integer",
    min: 0,
    max: 65535,
    unit: "px",
    default: 1600,
    label: "Matching size",
    description:
      "Longer side to which larger images are downscaled for feature matching; 0 matches at full resolution.",
  },
  maxKeypoints: {
    group: "matching",
    type: "integer",
    min: 1,
    max: 100_000,
    default: 8000,
    label: "Maximum keypoints",
    description: "Maximum number of keypoints described per image.",
  },
  contrastThreshold: {
    group: "matching",
    type: "number",
    min: 0,
    max: 1,
    default: 0.04,
    label: "Contrast threshold",
    description:
      "Minimum contrast of a keypoint, as a fraction of the intensity range (Lowe: 0.04).",
  },
  edgeThreshold: {
    group: "matching",
    type: "number",
    min: 1,
    default: 10,
    label: "Edge threshold",
    description:
      "Maximum ratio of the principal curvatures at a keypoint; points on edges exceed it.",
  },
  adaptiveContrast: {
    group: "matching",
    type: "boolean",
    default: true,
    label: "Lower the contrast threshold where features are few",
    description:
      "Lowers the contrast threshold until there are enough keypoints in all parts of the image.",
  },
  upsample: {
    group: "matching",
    type: "boolean",
    default: true,
    label: "Upsample first",
    description: "Upsamples images by 2 before detection, which finds the smallest features.",
  },
  rootSift: {
    group: "matching",
    type: "boolean",
    default: true,
    label: "RootSIFT",
    description: "Compares descriptors by their element-wise square roots (RootSIFT).",
  },
  matchRatio: {
    group: "matching",
    type: "number",
    min: 0,
    max: 1,
    exclusiveMin: true,
    default: 0.75,
    label: "Ratio test",
    description:
      "Ratio test: maximum distance to the nearest descriptor, relative to the second nearest.",
  },
  mutual: {
    group: "matching",
    type: "boolean",
    default: true,
    label: "Mutual nearest neighbours",
    description: "Keeps only mutual nearest neighbours (cross-check).",
  },
  guidedMatching: {
    group: "matching",
    type: "boolean",
    default: true,
    paper: false,
    label: "Guided matching",
    description:
      "Matches again along the epipolar lines once the geometry is known, and keeps the result if it fits better.",
  },
} as const satisfies Readonly<Record<string, OptionSpec>>;
