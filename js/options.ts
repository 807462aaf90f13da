/**
 * The table of all stitching options: type, range, default, unit and description of each, once.
 *
 * The `Options` type, the checks of the core, `docs/options.md`, the help of the command line and the fields of the
 * page are made from it. After a change run `npm run generate`, and read the new option in `src/wasm/options.rs`.
 */

import type { OptionSpec } from "./option-spec.js";

export type * from "./option-spec.js";

/** Every option, in the order of the pipeline. */
export const OPTIONS = {
  mode: {
    group: "preset",
    type: "choice",
    choices: { default: "depthstitch", paper: "as published" },
    default: "default",
    paper: "paper",
    label: "Method",
    description:
      'Selects the defaults of all other options: this package\'s own, or with "paper" those of the published method.',
  },

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
    description: "Maximum number of samples drawn by the robust estimator.",
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
    description: "Focal length of the target; 0 if unknown.",
  },

  refinement: {
    group: "warping",
    type: "choice",
    choices: { epipolar: "Along epipolar lines", none: "None" },
    default: "epipolar",
    paper: "none",
    label: "Depth refinement",
    description: "Refines inverse depth by stereo matching along the epipolar lines.",
  },
  refinementRange: {
    group: "warping",
    type: "number",
    min: 0,
    unit: "px",
    default: 0,
    label: "Search range",
    description:
      "Search range of the refinement, in both directions; 0 derives it from the residuals of the matches.",
  },
  warpMode: {
    group: "warping",
    type: "choice",
    choices: {
      forward: "Forward",
      backward: "Backward",
      "backward+void": "Backward + voids",
      optimal: "Optimal",
      soft: "Soft voids",
    },
    default: "soft",
    paper: "optimal",
    label: "Warp",
    description:
      'How the target is rendered: the paper\'s complete method ("optimal", with mode "paper" the default), one of its ablations, or with voids of the overlap as a confidence that the seam weighs ("soft").',
  },
  gridColumns: {
    group: "warping",
    type: "integer",
    min: 0,
    max: 65535,
    unit: "cells",
    default: 0,
    label: "Grid columns",
    description: "Columns of the grid over the target; 0 places one vertex per pixel.",
  },
  gridRows: {
    group: "warping",
    type: "integer",
    min: 0,
    max: 65535,
    unit: "cells",
    default: 0,
    label: "Grid rows",
    description: "Rows of the grid over the target; 0 places one vertex per pixel.",
  },
  holes: {
    group: "warping",
    type: "choice",
    choices: { nearest: "Nearest known depth", drop: "Not drawn" },
    default: "nearest",
    label: "Where depth is unknown",
    description: "Where a depth map has no value: uses the nearest known one, or draws nothing.",
  },
  voidDistance: {
    group: "warping",
    type: "number",
    min: 0,
    exclusiveMin: true,
    unit: "× target diagonal",
    default: 0.02,
    paper: 0.01,
    label: "Void distance",
    description:
      'β: a pixel is void where forward and reverse model disagree by more than this. Unless mode is "paper", less is enough where the colours differ unusually, and with depth from the images alone it is reduced by up to half.',
  },
  stretchLimit: {
    group: "warping",
    type: "number",
    min: 0,
    exclusiveMin: true,
    unit: "× average cell",
    default: 5,
    paper: 2,
    label: "Stretch limit",
    description:
      'Outside the reference, a warped cell longer than this is void; with mode "paper" 2.',
  },
  canvasLimit: {
    group: "warping",
    type: "number",
    min: 0,
    max: 100,
    unit: "× reference size",
    default: 2,
    label: "Canvas limit",
    description: "How far the canvas may extend beyond each side of the reference.",
  },

  projection: {
    group: "warping",
    type: "choice",
    choices: { auto: "Automatic", plane: "Plane", cylinder: "Cylinder", sphere: "Sphere" },
    default: "auto",
    paper: "plane",
    label: "Projection",
    description:
      "What images are shown on: the reference's image plane, a cylinder or a sphere. Automatic is whatever suits the field of view: for two images the plane, unless it would stretch the target very much.",
  },

  exposure: {
    group: "compositing",
    type: "choice",
    choices: { field: "Locally", gain: "Globally", none: "None" },
    default: "field",
    paper: "none",
    label: "Exposure compensation",
    description:
      "Adapts the target's exposure to the reference's: by a smooth field of gains, by one gain per channel, or not at all.",
  },
  seam: {
    group: "compositing",
    type: "choice",
    choices: { aligned: "Minimum cut, aligned", cut: "Minimum cut", none: "None" },
    default: "aligned",
    paper: "none",
    label: "Seam",
    description:
      "Selects one image per pixel of the overlap by a minimum cut, around which the target is then moved so that lines go on across it; by the cut alone; or blends both everywhere.",
  },
  blending: {
    group: "compositing",
    type: "choice",
    choices: { multiband: "Multiband", feather: "Feather", average: "Average" },
    default: "multiband",
    paper: "average",
    label: "Blending",
    description: "How the images are blended.",
  },
  feather: {
    group: "compositing",
    type: "integer",
    min: 0,
    max: 1000,
    unit: "px",
    default: 32,
    label: "Feather width",
    description: "Width of the ramp of feather blending.",
  },
  bands: {
    group: "compositing",
    type: "integer",
    min: 0,
    max: 10,
    default: 0,
    label: "Bands",
    description: "Number of bands of multiband blending; 0 derives it from the image size.",
  },
  fill: {
    group: "compositing",
    type: "choice",
    choices: { exemplar: "Patches of the background", smooth: "Smooth", none: "Left transparent" },
    default: "exemplar",
    paper: "smooth",
    label: "Fill voids",
    description:
      "How voids inside the mosaic are filled: by PatchMatch with patches of the background, by coherence transport from the border, or not at all.",
  },
  fillRadius: {
    group: "compositing",
    type: "integer",
    min: 1,
    max: 64,
    unit: "px",
    default: 5,
    label: "Fill radius",
    description:
      "Radius of the neighbourhood of a pixel filled by coherence transport; time grows with its square.",
  },
  fillMaxWidth: {
    group: "compositing",
    type: "number",
    min: 0,
    max: 100,
    unit: "× √(valid pixels)",
    default: 0.2,
    label: "Widest filled void",
    description:
      'Voids wider than this stay transparent except where they narrow; applies to "exemplar".',
  },
  maxBytes: {
    group: "compositing",
    type: "number",
    min: 1,
    max: 2 ** 32,
    unit: "bytes",
    default: 2 ** 31,
    label: "Memory limit",
    description: "Memory limit; a larger job is rejected before anything is allocated.",
  },
} as const satisfies Readonly<Record<string, OptionSpec>>;

/** The name of an option. */
export type OptionName = keyof typeof OPTIONS;

/** All options with their names, in the order of the table. */
export const OPTION_LIST = Object.entries(OPTIONS) as readonly (readonly [
  OptionName,
  OptionSpec,
])[];
