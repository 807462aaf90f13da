import type { Options } from "depthstitch";

type KeysOf<T> = { [K in keyof Options]: Options[K] extends T ? K : never }[keyof Options];
export type FlagKey = KeysOf<boolean>;
export type NumberKey = KeysOf<number>;
export type ChoiceKey = KeysOf<string>;

export interface FlagField {
  readonly flag: FlagKey;
  readonly label: string;
}

export interface NumberField {
  readonly key: NumberKey;
  readonly label: string;
  readonly hint?: string;
  readonly min: number;
  readonly max?: number;
  readonly step: number | "any";
  /** What the shown number is multiplied by: megabytes to bytes, percent to share. */
  readonly unit?: number;
}

/** The choices are keyed by the option's own values, so that none can be forgotten. */
export type ChoiceField = {
  [K in ChoiceKey]: {
    readonly key: K;
    readonly label: string;
    readonly choices: Readonly<Record<Options[K], string>>;
  };
}[ChoiceKey];

export type Field = NumberField | ChoiceField | FlagField | "threshold";

export const modeField: ChoiceField = {
  key: "mode",
  label: "Method",
  choices: { default: "depthstitch", paper: "as published" },
};

const withoutDepth: ChoiceField = {
  key: "withoutDepth",
  label: "Without depth maps",
  choices: { "two-view": "Depth from the photos", homography: "A homography" },
};
const robustFit: ChoiceField = {
  key: "robustFit",
  label: "Robust fit",
  choices: { depth: "Depth", homography: "Homography", "multi-homography": "Several homographies" },
};
const calibration: ChoiceField = {
  key: "calibration",
  label: "Calibrated camera",
  choices: { auto: "Where it explains as much", always: "Always", off: "Never" },
};
const refinement: ChoiceField = {
  key: "refinement",
  label: "Refine depth",
  choices: { epipolar: "Along epipolar lines", none: "No" },
};
const warpMode: ChoiceField = {
  key: "warpMode",
  label: "Warp",
  choices: {
    optimal: "Optimal",
    "backward+void": "Backward + voids",
    backward: "Backward",
    forward: "Forward",
  },
};
const holes: ChoiceField = {
  key: "holes",
  label: "Where depth is unknown",
  choices: { nearest: "Nearest known", drop: "Draw nothing" },
};
const exposure: ChoiceField = {
  key: "exposure",
  label: "Fit the exposure",
  choices: { field: "Place by place", gain: "As a whole", none: "No" },
};
const seam: ChoiceField = {
  key: "seam",
  label: "Seam",
  choices: { cut: "Where they differ least", none: "None: mix everywhere" },
};
const blending: ChoiceField = {
  key: "blending",
  label: "Blend",
  choices: { multiband: "In bands of detail", feather: "Gradually", average: "Average" },
};
const fill: ChoiceField = {
  key: "fill",
  label: "Voids in the mosaic",
  choices: { exemplar: "From similar places", smooth: "Smoothly", none: "Leave empty" },
};

export const groups: readonly { readonly title: string; readonly fields: readonly Field[] }[] = [
  {
    title: "Matching",
    fields: [
      {
        key: "matchSize",
        label: "Match at",
        hint: "px of the longer side, 0: all",
        min: 0,
        step: 1,
      },
      { key: "maxKeypoints", label: "Most keypoints", min: 1, step: 1 },
      { key: "contrastThreshold", label: "Least contrast", min: 0, step: "any" },
      {
        key: "edgeThreshold",
        label: "Edge limit",
        hint: "ratio of curvatures",
        min: 1,
        step: "any",
      },
      { key: "matchRatio", label: "Ratio test", min: 0, max: 1, step: "any" },
      { flag: "adaptiveContrast", label: "Lower the contrast where features are few" },
      { flag: "upsample", label: "Double the photos first" },
      { flag: "rootSift", label: "Compare square roots (RootSIFT)" },
      { flag: "mutual", label: "Best match both ways" },
      { flag: "guidedMatching", label: "Match again along epipolar lines" },
    ],
  },
  {
    title: "Geometry",
    fields: [
      withoutDepth,
      robustFit,
      "threshold",
      calibration,
      {
        key: "focalLength",
        label: "Focal length",
        hint: "px of the first photo, 0: unknown",
        min: 0,
        step: "any",
      },
      { key: "maxTrials", label: "Most trials", min: 1, step: 1 },
      { key: "confidence", label: "Confidence", min: 0, max: 1, step: "any" },
      {
        key: "seed",
        label: "Seed",
        hint: "same seed, same result",
        min: 0,
        max: 2 ** 32 - 1,
        step: 1,
      },
    ],
  },
  {
    title: "Depth and warp",
    fields: [
      refinement,
      {
        key: "refinementRange",
        label: "Search range",
        hint: "px, 0: by the residuals",
        min: 0,
        step: "any",
      },
      warpMode,
      holes,
      {
        key: "gridColumns",
        label: "Grid columns",
        hint: "0: one vertex per pixel",
        min: 0,
        step: 1,
      },
      { key: "gridRows", label: "Grid rows", hint: "0: one vertex per pixel", min: 0, step: 1 },
      {
        key: "voidDistance",
        label: "Void distance",
        hint: "% of the diagonal",
        min: 0,
        step: "any",
        unit: 0.01,
      },
      {
        key: "stretchLimit",
        label: "Stretch limit",
        hint: "× the average cell",
        min: 0,
        step: "any",
      },
      {
        key: "canvasLimit",
        label: "Canvas limit",
        hint: "× the second photo, each side",
        min: 0,
        step: "any",
      },
    ],
  },
  {
    title: "Joining",
    fields: [
      exposure,
      seam,
      blending,
      {
        key: "feather",
        label: "Feather",
        hint: "px from end to end",
        min: 0,
        step: "any",
      },
      {
        key: "bands",
        label: "Bands",
        hint: "0: by the photos' size",
        min: 0,
        step: 1,
      },
      fill,
      { key: "fillRadius", label: "Fill radius", hint: "pixels", min: 0, step: 1 },
      {
        key: "fillMaxWidth",
        label: "Widest void",
        hint: "share of the picture's size",
        min: 0,
        step: "any",
      },
      { key: "maxBytes", label: "Memory limit", hint: "MB", min: 1, step: 1, unit: 1e6 },
    ],
  },
];
