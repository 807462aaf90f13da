// Depth, its refinement, and the warp.
import type { OptionSpec } from "../option-spec.js";

export const warping = {
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
      'β: a pixel is void where forward and reverse model disagree by more than this. Unless mode is "paper", less is enough where the colours differ unusually. For two images alone with refinement it plays no part; with depth from the images otherwise it is reduced by up to half.',
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
      'Outside the reference, a warped cell longer than this is void; with mode "paper" 2. Of two images, not on a cylinder or sphere without depth maps.',
  },
  canvasLimit: {
    group: "warping",
    type: "number",
    min: 0,
    max: 100,
    unit: "× reference size",
    default: 2,
    label: "Canvas limit",
    description:
      "How far the canvas may extend beyond each side of the reference; of many images, beyond where one that is hardly stretched appears.",
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
} as const satisfies Readonly<Record<string, OptionSpec>>;
