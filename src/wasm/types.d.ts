/** An RGBA picture, 8 bit, row by row from the top left: an `ImageData` fits. The alpha of an input is ignored. */
export interface ImageInput {
  readonly data: Uint8ClampedArray | Uint8Array;
  readonly width: number;
  readonly height: number;
}

/** An RGBA picture that came out. Alpha is validity: 255 where there is a picture, 0 elsewhere. */
export interface ImageOutput {
  data: Uint8ClampedArray<ArrayBuffer>;
  width: number;
  height: number;
}

/** One byte per pixel, 255 for yes and 0 for no. */
export interface Mask {
  data: Uint8Array<ArrayBuffer>;
  width: number;
  height: number;
}

/** A depth map, of any size; it is resampled to its photo's. */
export interface DepthInput {
  readonly data: Float32Array | Uint16Array | Uint8Array;
  readonly width: number;
  readonly height: number;
  /** `inverse`: larger is nearer (Depth Anything, MiDaS, disparity). `metric`: distance, in any unit. */
  readonly kind: "inverse" | "metric";
  /** The value that means "unknown". Values that are not finite, and metric ones not above 0, are unknown anyway. */
  readonly invalid?: number | null | undefined;
}

export type Stage = "input" | "estimate" | "warp" | "blend" | "fill" | "measure";

/** Every setting. Each is optional where options are passed; `defaultOptions()` has the defaults. */
export interface Options {
  /** What picks the inliers: the paper's depth-RANSAC, or one of the two it compares with. */
  robustFit: "depth" | "homography" | "multi-homography";
  /** Largest transfer error of an inlier in pixels of the reference, or `"paper"`: 0.1 in normalised coordinates. */
  threshold: number | "paper";
  /** Chance, 0 to 1, that one sample at least was free of outliers when sampling stops. */
  confidence: number;
  /** Most samples to draw. */
  maxTrials: number;
  /** Seed of the sampler, a whole number from 0 to 2³²−1. The same seed gives the same bytes. */
  seed: number;
  /** How the target is rendered: the paper's full way, or one of its ablations. */
  warpMode: "forward" | "backward" | "backward+void" | "optimal";
  /** Columns of grid cells over the target; 0 for one vertex per pixel. */
  gridColumns: number;
  /** Rows of grid cells over the target; 0 for one vertex per pixel. */
  gridRows: number;
  /** Where a depth map has no value: take the nearest known one, or draw nothing there. */
  holes: "nearest" | "drop";
  /** β: where forward and reverse model disagree by more than this share of the target's diagonal is a void. */
  voidDistance: number;
  /** Outside the reference, a cell longer than this many times the average cell is a void. */
  stretchLimit: number;
  /** How far the canvas may reach beyond each side of the reference, in reference sizes. */
  canvasLimit: number;
  /** Whether the mosaic's inner voids are filled. */
  fill: "smooth" | "none";
  /** Radius in pixels of the neighbourhood that a filled pixel is drawn from. */
  fillRadius: number;
  /** Most bytes the core may take; a larger job is refused before anything is allocated. */
  maxBytes: number;
}

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** Depth maps of the two photos: both, or neither. */
export interface Depths {
  readonly targetDepth?: DepthInput | undefined;
  readonly referenceDepth?: DepthInput | undefined;
}

/** What `stitch` takes besides the photos. */
export interface StitchInputs extends Depths {
  /** xt, yt, xr, yr of every match, in pixels. */
  readonly matches?: Float32Array | undefined;
}

/** What `estimate` takes. */
export interface EstimateInputs extends Depths {
  readonly targetSize: Size;
  readonly referenceSize: Size;
  /** xt, yt, xr, yr of every match, in pixels. */
  readonly matches: Float32Array;
}

/** x' ~ h·(x, y, 1) + e·d(x): `h` is 3×3 row by row, `e` the epipole scaled with inverse depth. */
export interface Model {
  h: Float64Array;
  e: Float64Array;
}

/** The maps both ways. */
export interface Models {
  /** Target to reference. */
  forward: Model;
  /** Reference to target. */
  reverse: Model;
}

/** Something a person should know about a result that is not an error. */
export interface Remark {
  /** Stable, for programs: `parallax-unobservable`, `few-inliers`, `poor-alignment`, … */
  code: string;
  /** One sentence for people. */
  message: string;
}

/** Both models and how they were found. */
export interface Geometry extends Models {
  /** One flag (0 or 1) per match passed, in the same order. */
  inliers: Uint8Array<ArrayBuffer>;
  report: FitReport;
}

export interface FitReport {
  /** Whether parallax is part of the models. */
  model: "depth" | "homography";
  /** Matches passed. */
  matches: number;
  /** Matches left once non-finite, out-of-frame, duplicated and depthless ones are dropped. */
  usable: number;
  inliers: number;
  /** The threshold that chose the inliers, in pixels of the reference. */
  threshold: number;
  /** Samples drawn. */
  trials: number;
  /** Median transfer error of the inliers in pixels: forward, reverse. */
  residual: [number, number];
  warnings: Remark[];
}

/** The target as the reference's camera would see it, on a canvas that holds both photos. */
export interface Warped {
  warped: ImageOutput;
  /** Where any cell of the target was drawn, voided ones included. */
  footprint: Mask;
  /** Canvas position of the reference's top left pixel. */
  offset: { x: number; y: number };
  /** Whether part of the target lay beyond the canvas limit. */
  clipped: boolean;
}

/** The two photos on one canvas. */
export interface Mosaic {
  mosaic: ImageOutput;
  /** Pixels inside the target's footprint that neither photo covers. */
  voidMask: Mask;
}

/** Agreement over the overlap. Quote PSNR only together with coverage. */
export interface Quality {
  /** PSNR in dB over the overlap's bounding box, both black outside the overlap (the authors' measure). */
  psnrBbox: number;
  ssimBbox: number;
  /** PSNR in dB over valid pixels only. */
  psnrMask: number;
  ssimMask: number;
  /** Valid share of the reference, 0 to 1. */
  coverage: number;
}

export interface StitchResult extends Warped, Mosaic, Geometry {
  quality: Quality;
  /** Milliseconds per stage. */
  times: Record<Stage, number>;
}
