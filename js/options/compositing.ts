// Exposure, seam, blending, filling, and the limit of memory.
import type { OptionSpec } from "../option-spec.js";

export const compositing = {
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
    description:
      "Memory limit; a larger job is rejected before anything is allocated, but many images are shown smaller if they then fit.",
  },
} as const satisfies Readonly<Record<string, OptionSpec>>;
