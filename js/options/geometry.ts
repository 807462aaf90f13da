// The models between the two photos.
import type { OptionSpec } from "../option-spec.js";

export const geometry = {
  withoutDepth: {
    group: "geometry",
    type: "choice",
    choices: { "two-view": "Depth from the photos", homography: "Homography" },
    default: "two-view",
    paper: "homography",
    label: "Without depth maps",
    description:
      "Without depth maps: estimates depth from the two images, or aligns them by a homography.",
  },
  robustFit: {
    group: "geometry",
    type: "choice",
    choices: {
      depth: "Depth model",
      homography: "Homography",
      "multi-homography": "Several homographies",
    },
    default: "depth",
    label: "Robust fit",
    description:
      "Model that selects the inliers: the paper's depth model, or one of the two it is compared with.",
  },
  threshold: {
    group: "geometry",
    type: "number",
    min: 0,
    exclusiveMin: true,
    keyword: "paper",
    unit: "px",
    default: 3,
    paper: "paper",
    label: "Inlier threshold",
    description:
      'Maximum transfer error of an inlier in pixels of the reference, or "paper": 0.1 in normalized coordinates.',
  },
  confidence: {
    group: "geometry",
    type: "number",
    min: 0,
    max: 1,
    exclusiveMin: true,
    exclusiveMax: true,
    default: 0.99,
    label: "Confidence",
    description:
      "Sampling stops when the probability that one sample was free of outliers reaches this.",
  },
  maxTrials: {
    group: "geometry",
    type: "integer",
    min: 1,
    max: 1_000_000,
    default: 2000,
    label: "Maximum trials",
    description: "Maximum number of samples drawn by each search of the robust estimator.",
  },
  seed: {
    group: "geometry",
    type: "integer",
    min: 0,
    max: 2 ** 32 - 1,
    default: 1,
    label: "Seed",
    description: "Seed of the sampler; the same inputs and seed give the same bytes.",
  },
  calibration: {
    group: "geometry",
    type: "choice",
    choices: { auto: "If it explains the matches as well", always: "Always", off: "Never" },
    default: "auto",
    paper: "off",
    label: "Calibrated model",
    description:
      "Fits rotation, translation and focal length instead of twelve free parameters: if they explain the matches as well, always, or never.",
  },
  focalLength: {
    group: "geometry",
    type: "number",
    min: 0,
    unit: "px",
    default: 0,
    label: "Focal length",
    description:
      "Focal length of the target; 0 if unknown. Of three photos or more, the command line and the page take it from EXIF data by default.",
  },
} as const satisfies Readonly<Record<string, OptionSpec>>;
