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

/** An inverse-depth map that came out, of its photo's size: it fits as an input. */
export interface DepthOutput {
  data: Float32Array<ArrayBuffer>;
  width: number;
  height: number;
  kind: "inverse";
}

export type Stage =
  | "input"
  | "detect"
  | "match"
  | "estimate"
  | "depth"
  | "refine"
  | "warp"
  | "measure"
  | "blend"
  | "fill";

/** Every setting. Each is optional where options are passed; `defaultOptions()` has the defaults. */
export interface Options {
  /** Which defaults the other settings have: this package's own, or those of the published method. */
  mode: "default" | "paper";
  /** Photos whose longer side has more pixels are matched at this size; 0 matches all at their own. */
  matchSize: number;
  /** Most keypoints that are described in a photo. */
  maxKeypoints: number;
  /** Least contrast of a keypoint, as a share of the range of brightness (Lowe: 0.04). */
  contrastThreshold: number;
  /** Largest ratio of principal curvatures of a keypoint: longer edges are no points. */
  edgeThreshold: number;
  /** Whether the contrast asked for drops until there are enough keypoints all over the photo. */
  adaptiveContrast: boolean;
  /** Whether photos are doubled before the search, which finds the smallest features. */
  upsample: boolean;
  /** Whether descriptors are compared by their square roots (RootSIFT). */
  rootSift: boolean;
  /** A match must be closer than this many times the second best. */
  matchRatio: number;
  /** Whether both features of a match must be each other's best. */
  mutual: boolean;
  /** Whether own matches are searched again along the epipolar lines once the geometry is known. */
  guidedMatching: boolean;
  /** Without depth maps: depth from the two photos themselves, or alignment by a homography. */
  withoutDepth: "two-view" | "homography";
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
  /**
   * Whether rotation, translation and one focal length are fitted instead of twelve free numbers: where that explains
   * the matches as well, always, or never.
   */
  calibration: "auto" | "always" | "off";
  /** Focal length of the target in its pixels where it is known, 0 where it is not. */
  focalLength: number;
  /** Whether inverse depth is refined along the epipolar lines. */
  refinement: "epipolar" | "none";
  /** How far the refinement looks, in pixels both ways; 0 for as far as the matches' residuals suggest. */
  refinementRange: number;
  /** How the target is rendered: the paper's full way, or one of its ablations. */
  warpMode: "forward" | "backward" | "backward+void" | "optimal";
  /** Columns of grid cells over the target; 0 for one vertex per pixel. */
  gridColumns: number;
  /** Rows of grid cells over the target; 0 for one vertex per pixel. */
  gridRows: number;
  /** Where a depth map has no value: take the nearest known one, or draw nothing there. */
  holes: "nearest" | "drop";
  /**
   * β: where forward and reverse model disagree by more than this share of the target's diagonal is a void; by less where
   * the colours differ by more than they mostly do. Down to half of it with depth from the two photos alone.
   */
  voidDistance: number;
  /** Outside the reference, a cell longer than this many times the average cell is a void. */
  stretchLimit: number;
  /** How far the canvas may reach beyond each side of the reference, in reference sizes. */
  canvasLimit: number;
  /** How the target's exposure is fitted to the reference's: by a smooth field of gains, by one gain, or not at all. */
  exposure: "field" | "gain" | "none";
  /** Whether a seam decides which photo shows where both do. */
  seam: "cut" | "none";
  /** How the photos are blended. */
  blending: "multiband" | "feather" | "average";
  /** Pixels from one end of a feathered ramp to the other. */
  feather: number;
  /** Bands of the multiband blending; 0 for as many as the photos' size asks for. */
  bands: number;
  /** How the mosaic's inner voids are filled: from similar places farther back, smoothly from their borders, or not. */
  fill: "exemplar" | "smooth" | "none";
  /** Radius in pixels of the neighbourhood that a filled pixel is drawn from. */
  fillRadius: number;
  /** How wide a void may be to be filled, as a share of the picture's size; wider ones stay transparent. Only `"exemplar"`. */
  fillMaxWidth: number;
  /** Most bytes the core may take; a larger job is refused before anything is allocated. */
  maxBytes: number;
}

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** Depth maps of the two photos. Where one is missing it is derived from the other, where both are, from the photos. */
export interface Depths {
  readonly targetDepth?: DepthInput | undefined;
  readonly referenceDepth?: DepthInput | undefined;
}

/** What `stitch` takes besides the photos. */
export interface StitchInputs extends Depths {
  /** xt, yt, xr, yr of every match, in pixels. Without them, SIFT features are detected and matched. */
  readonly matches?: Float32Array | undefined;
  /** Whether the result is to have the inverse depth that the photos were warped with (default `false`). */
  readonly outputDepth?: boolean | undefined;
}

/** The features of a photo, strongest first. */
export interface Features {
  /** Five numbers each: x, y and scale (σ) in pixels, angle in radians, response. */
  keypoints: Float32Array<ArrayBuffer>;
  /** 128 bytes each. */
  descriptors: Uint8Array<ArrayBuffer>;
  /** Width of the photo. */
  width: number;
  /** Height of the photo. */
  height: number;
}

/** Which features of two photos show the same thing. */
export interface Matches {
  /** xt, yt, xr, yr of every match, in pixels: what `stitch` and `estimate` take. */
  matches: Float32Array<ArrayBuffer>;
  /** The places of every match's two features in their lists: target, reference. */
  pairs: Uint32Array<ArrayBuffer>;
}

/** The features of both photos, and their matches. */
export interface ImageMatches extends Matches {
  target: Features;
  reference: Features;
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
  /**
   * What was fitted: H∞ and e' freely (`depth`), from rotation, translation and focal length (`calibrated`), with depth
   * from the matches alone (`two-view`), or without parallax (`homography`).
   */
  model: "depth" | "calibrated" | "two-view" | "homography";
  /** Focal length in pixels of the target, where one was fitted or given. */
  focalLength: number | null;
  /** Matches passed. */
  matches: number;
  /** Matches left once non-finite, out-of-frame, duplicated and depthless ones are dropped. */
  usable: number;
  inliers: number;
  /**
   * Points followed over the overlap that were fitted besides the matches: where the depth errs hardly more than they do.
   * Not by `estimate`, which sees no pixels.
   */
  followed: number;
  /** The threshold that chose the inliers, in pixels of the reference. */
  threshold: number;
  /** Samples drawn. */
  trials: number;
  /** Median transfer error of the inliers, and of the points followed, in pixels: forward, reverse. */
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
  /** Which photo shows: 0 none, 1 the target, 2 the reference, 3 both alike. */
  seam: Mask;
  /** What the target's red, green and blue were multiplied by in linear light, on average over the overlap. */
  gains: [number, number, number];
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

/** What a person sees of a mosaic: lower is better, 0 is perfect, null where there is too little to judge. */
export interface Appearance {
  /** Share of void in the band of 2 % of the diagonal inside the reference's border, within the target's footprint. */
  borderVoids: number;
  /** Share of void in the whole overlap. */
  overlapVoids: number;
  /** Share of the seam within 3 pixels of the reference's border: it had nowhere else to go. */
  seamOnBorder: number | null;
  /** Pixels of the seam over the square root of the overlap's: islands and zigzags. */
  seamLength: number;
  /** Share of the seam with a step of colour larger, by more than 3 in CIELAB, than nine tenths of those beside it. */
  visibleSteps: number | null;
  /** Share of the target's straight lines that the warp breaks by more than 2 degrees, of those it puts inside the reference. */
  brokenInside: number | null;
  /** The same, of those across the reference's border. */
  brokenAcross: number | null;
  /** The same, of those outside. */
  brokenOutside: number | null;
  /** RMS distance of what lies outside the reference from the best homography, in % of the reference's diagonal. */
  bending: number | null;
}

/** A rectangle of whole pixels. */
export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** The first half of the whole way: what `warp` needs besides the photos. */
export interface Alignment extends Geometry {
  /** xt, yt, xr, yr of every match, passed or found. */
  matches: Float32Array<ArrayBuffer>;
  /** The inverse depth that goes with the models, where there is any. */
  targetDepth?: DepthOutput;
  referenceDepth?: DepthOutput;
  /** The option to warp with: with depth from the two photos alone less than what was asked for. */
  voidDistance: number;
  /** Reference pixels whose depth the refinement is sure of; null without refinement. */
  trusted: Mask | null;
}

export interface StitchResult extends Warped, Mosaic, Geometry {
  /** Of the mosaic, the largest rectangle without a transparent pixel, and the smallest one with everything. */
  crop: { inner: Rect | null; bounds: Rect | null };
  /** xt, yt, xr, yr of every match, passed or found; `inliers` has a flag for each. */
  matches: Float32Array<ArrayBuffer>;
  /** With `outputDepth`: the inverse depth that the target was warped with, where there is any. */
  targetDepth?: DepthOutput;
  /** With `outputDepth`: that of the reference. */
  referenceDepth?: DepthOutput;
  quality: Quality;
  /** Milliseconds of every stage that was gone through. */
  times: Partial<Record<Stage, number>>;
}
