/**
 * An 8-bit RGBA image in row-major order, such as an `ImageData`. Pixels of a photo with an alpha below 128 are masked: they take
 * part in nothing, whatever colour is beneath. All others are opaque. Missing pixels that hang together with the photo's border are where it ends,
 * others are holes: the mosaic shows another photo there, or has a void to be filled.
 */
export interface ImageInput {
  readonly data: Uint8ClampedArray | Uint8Array;
  readonly width: number;
  readonly height: number;
}

/** An RGBA image in a result. Alpha is validity: 255 for valid pixels, 0 elsewhere. */
export interface ImageOutput {
  data: Uint8ClampedArray<ArrayBuffer>;
  width: number;
  height: number;
}

/** One byte per pixel: 255 is set, 0 is not. */
export interface Mask {
  data: Uint8Array<ArrayBuffer>;
  width: number;
  height: number;
}

/** A depth map of any size. It is resampled bilinearly to the size of its image. */
export interface DepthInput {
  readonly data: Float32Array | Uint16Array | Uint8Array;
  readonly width: number;
  readonly height: number;
  /** `inverse`: larger is nearer (Depth Anything, MiDaS, disparity). `metric`: distance, in any unit. */
  readonly kind: "inverse" | "metric";
  /** The value that means "unknown". Non-finite values and metric depth that is not positive are always unknown. */
  readonly invalid?: number | null | undefined;
}

/** An inverse depth map in a result, of the size of its image. It can be passed as an input. */
export interface DepthOutput {
  data: Float32Array<ArrayBuffer>;
  width: number;
  height: number;
  kind: "inverse";
}

/** A stage of the pipeline, in progress reports, errors and times. */
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

/** All options with their values. Calls take any subset; `defaultOptions()` returns the defaults. */
export interface Options {
  /**
   * Selects the defaults of all other options: this package's own, or with "paper" those of the
   * published method. Default: default (paper with mode "paper").
   */
  mode: "default" | "paper";
  /**
   * Longer side to which larger images are downscaled for feature matching; 0 matches at full
   * resolution. Unit: px. Range: an integer from 0 to 65535. Default: 1600.
   */
  matchSize: number;
  /**
   * Maximum number of keypoints described per image. Range: an integer from 1 to 100000. Default:
   * 8000.
   */
  maxKeypoints: number;
  /**
   * Minimum contrast of a keypoint, as a fraction of the intensity range (Lowe: 0.04). Range: a
   * number from 0 to 1. Default: 0.04.
   */
  contrastThreshold: number;
  /**
   * Maximum ratio of the principal curvatures at a keypoint; points on edges exceed it. Range: a
   * number of at least 1. Default: 10.
   */
  edgeThreshold: number;
  /**
   * Lowers the contrast threshold until there are enough keypoints in all parts of the image.
   * Default: true.
   */
  adaptiveContrast: boolean;
  /** Upsamples images by 2 before detection, which finds the smallest features. Default: true. */
  upsample: boolean;
  /** Compares descriptors by their element-wise square roots (RootSIFT). Default: true. */
  rootSift: boolean;
  /**
   * Ratio test: maximum distance to the nearest descriptor, relative to the second nearest. Range:
   * a number above 0, at most 1. Default: 0.75.
   */
  matchRatio: number;
  /** Keeps only mutual nearest neighbours (cross-check). Default: true. */
  mutual: boolean;
  /**
   * Matches again along the epipolar lines once the geometry is known, and keeps the result if it
   * fits better. Default: true (false with mode "paper").
   */
  guidedMatching: boolean;
  /**
   * Without depth maps: estimates depth from the two images, or aligns them by a homography.
   * Default: two-view (homography with mode "paper").
   */
  withoutDepth: "two-view" | "homography";
  /**
   * Model that selects the inliers: the paper's depth model, or one of the two it is compared with.
   * Default: depth.
   */
  robustFit: "depth" | "homography" | "multi-homography";
  /**
   * Maximum transfer error of an inlier in pixels of the reference, or "paper": 0.1 in normalized
   * coordinates. Unit: px. Range: a number above 0, or "paper". Default: 3 (paper with mode
   * "paper").
   */
  threshold: number | "paper";
  /**
   * Sampling stops when the probability that one sample was free of outliers reaches this. Range: a
   * number between 0 and 1, exclusive. Default: 0.99.
   */
  confidence: number;
  /**
   * Maximum number of samples drawn by each search of the robust estimator. Range: an integer from
   * 1 to 1000000. Default: 2000.
   */
  maxTrials: number;
  /**
   * Seed of the sampler; the same inputs and seed give the same bytes. Range: an integer from 0 to
   * 4294967295. Default: 1.
   */
  seed: number;
  /**
   * Fits rotation, translation and focal length instead of twelve free parameters: if they explain
   * the matches as well, always, or never. Default: auto (off with mode "paper").
   */
  calibration: "auto" | "always" | "off";
  /**
   * Focal length of the target; 0 if unknown. Of three photos or more, the command line and the
   * page take it from EXIF data by default. Unit: px. Range: a number of at least 0. Default: 0.
   */
  focalLength: number;
  /**
   * Refines inverse depth by stereo matching along the epipolar lines. Default: epipolar (none with
   * mode "paper").
   */
  refinement: "epipolar" | "none";
  /**
   * Search range of the refinement, in both directions; 0 derives it from the residuals of the
   * matches. Unit: px. Range: a number of at least 0. Default: 0.
   */
  refinementRange: number;
  /**
   * How the target is rendered: the paper's complete method ("optimal", with mode "paper" the
   * default), one of its ablations, or with voids of the overlap as a confidence that the seam
   * weighs ("soft"). Default: soft (optimal with mode "paper").
   */
  warpMode: "forward" | "backward" | "backward+void" | "optimal" | "soft";
  /**
   * Columns of the grid over the target; 0 places one vertex per pixel. Unit: cells. Range: an
   * integer from 0 to 65535. Default: 0.
   */
  gridColumns: number;
  /**
   * Rows of the grid over the target; 0 places one vertex per pixel. Unit: cells. Range: an integer
   * from 0 to 65535. Default: 0.
   */
  gridRows: number;
  /**
   * Where a depth map has no value: uses the nearest known one, or draws nothing. Default: nearest.
   */
  holes: "nearest" | "drop";
  /**
   * β: a pixel is void where forward and reverse model disagree by more than this. Unless mode is
   * "paper", less is enough where the colours differ unusually. For two images alone with
   * refinement it plays no part; with depth from the images otherwise it is reduced by up to half.
   * Unit: × target diagonal. Range: a number above 0. Default: 0.02 (0.01 with mode "paper").
   */
  voidDistance: number;
  /**
   * Outside the reference, a warped cell longer than this is void; with mode "paper" 2. Of two
   * images, not on a cylinder or sphere without depth maps. Unit: × average cell. Range: a number
   * above 0. Default: 5 (2 with mode "paper").
   */
  stretchLimit: number;
  /**
   * How far the canvas may extend beyond each side of the reference; of many images, beyond where
   * one that is hardly stretched appears. Unit: × reference size. Range: a number from 0 to 100.
   * Default: 2.
   */
  canvasLimit: number;
  /**
   * What images are shown on: the reference's image plane, a cylinder or a sphere. Automatic is
   * whatever suits the field of view: for two images the plane, unless it would stretch the target
   * very much. Default: auto (plane with mode "paper").
   */
  projection: "auto" | "plane" | "cylinder" | "sphere";
  /**
   * Adapts the target's exposure to the reference's: by a smooth field of gains, by one gain per
   * channel, or not at all. Default: field (none with mode "paper").
   */
  exposure: "field" | "gain" | "none";
  /**
   * Selects one image per pixel of the overlap by a minimum cut, around which the target is then
   * moved so that lines go on across it; by the cut alone; or blends both everywhere. Default:
   * aligned (none with mode "paper").
   */
  seam: "aligned" | "cut" | "none";
  /** How the images are blended. Default: multiband (average with mode "paper"). */
  blending: "multiband" | "feather" | "average";
  /**
   * Width of the ramp of feather blending. Unit: px. Range: an integer from 0 to 1000. Default: 32.
   */
  feather: number;
  /**
   * Number of bands of multiband blending; 0 derives it from the image size. Range: an integer from
   * 0 to 10. Default: 0.
   */
  bands: number;
  /**
   * How voids inside the mosaic are filled: by PatchMatch with patches of the background, by
   * coherence transport from the border, or not at all. Default: exemplar (smooth with mode
   * "paper").
   */
  fill: "exemplar" | "smooth" | "none";
  /**
   * Radius of the neighbourhood of a pixel filled by coherence transport; time grows with its
   * square. Unit: px. Range: an integer from 1 to 64. Default: 5.
   */
  fillRadius: number;
  /**
   * Voids wider than this stay transparent except where they narrow; applies to "exemplar". Unit: ×
   * √(valid pixels). Range: a number from 0 to 100. Default: 0.2.
   */
  fillMaxWidth: number;
  /**
   * Memory limit; a larger job is rejected before anything is allocated, but many images are shown
   * smaller if they then fit. Unit: bytes. Range: a number from 1 to 4294967296. Default:
   * 2147483648.
   */
  maxBytes: number;
}

/** Size of an image in pixels. */
export interface Size {
  readonly width: number;
  readonly height: number;
}

/**
 * Depth maps of the two images. `stitch` and `align` derive a missing one, or estimate both, unless `withoutDepth` is
 * `"homography"`; `estimate` then fits a homography; `warp` needs both for models with parallax.
 */
export interface Depths {
  readonly targetDepth?: DepthInput | null | undefined;
  readonly referenceDepth?: DepthInput | null | undefined;
}

/** Inputs of `stitch` and `align` besides the images. */
export interface StitchInputs<O extends Output = Output> extends Depths {
  /** xt, yt, xr, yr of every match, in pixels. By default, SIFT features are detected and matched. */
  readonly matches?: Float32Array | null | undefined;
  /** Whether to return the inverse depth that was used (default `false`). */
  readonly outputDepth?: boolean | undefined;
  /** Which pictures and masks `stitch` returns (default: all). The others are never copied out of the core's memory. */
  readonly outputs?: readonly O[] | undefined;
}

/** Pictures and masks of a {@link StitchResult}, which are most of its bytes, by the names of their fields. */
export type Output =
  "mosaic" | "voidMask" | "seam" | "warped" | "footprint" | "confidence" | "projectedReference";

/** The features of an image, strongest first. */
export interface Features {
  /** Five numbers per keypoint: x, y and scale (σ) in pixels, angle in radians, response. */
  keypoints: Float32Array<ArrayBuffer>;
  /** 128 bytes per keypoint. */
  descriptors: Uint8Array<ArrayBuffer>;
  /** Width of the image. */
  width: number;
  /** Height of the image. */
  height: number;
}

/** Corresponding features of two images. */
export interface Matches {
  /** xt, yt, xr, yr of every match, in pixels, as `stitch` and `estimate` take them. */
  matches: Float32Array<ArrayBuffer>;
  /** Indices of the two features of every match: target, reference. */
  pairs: Uint32Array<ArrayBuffer>;
}

/** The features of both images and their matches. */
export interface ImageMatches extends Matches {
  target: Features;
  reference: Features;
}

/** Inputs of `estimate`. */
export interface EstimateInputs extends Depths {
  readonly targetSize: Size;
  readonly referenceSize: Size;
  /** xt, yt, xr, yr of every match, in pixels. */
  readonly matches: Float32Array;
}

/** The map x' ~ h·(x, y, 1) + e·d(x): `h` is a 3×3 matrix in row-major order, `e` the epipole, `d` inverse depth. */
export interface Model {
  h: Float64Array;
  e: Float64Array;
}

/** The maps in both directions. */
export interface Models {
  /** Target to reference. */
  forward: Model;
  /** Reference to target. */
  reverse: Model;
}

/** What a result is warned of. The codes are stable; later versions may add others. */
export type WarningCode =
  /** At least one map is missing, and `withoutDepth` is `"homography"` or `estimate` was called: a homography was fitted. */
  | "no-depth"
  /** The depth maps do not explain how the images differ: at least one of them was ignored. */
  | "depth-inconsistent"
  /**
   * The depth maps have values at too few matches, and were ignored. Depth comes from the images instead; with `withoutDepth`
   * `"homography"`, and from `estimate`, a homography is fitted.
   */
  | "depth-unusable"
  /** A homography explains the matches as well, and was taken. */
  | "parallax-unobservable"
  /** Two images alone: beyond the reference the target is aligned like one plane of the scene. */
  | "outside-extrapolated"
  /** Two images alone: they are aligned by a homography, as with depth the part beyond the reference would bend or tear. */
  | "parallax-ignored"
  /** The model rests on few matches. */
  | "few-inliers"
  /** Most matches disagree with the model. */
  | "low-inlier-ratio"
  /** Too few matches agreed within `threshold`; a wider one was used. */
  | "threshold-widened"
  /** Many images: the mosaic is smaller than they are, at `scale`, as more would take more memory than `maxBytes`. */
  | "reduced-resolution"
  /** Part of the target lay beyond `canvasLimit`. */
  | "canvas-clipped"
  /** The images differ where they should agree. */
  | "poor-alignment"
  /** The overlap covers little of the reference. */
  | "small-overlap";

/** A warning about a result. */
export interface Warning {
  code: WarningCode;
  /** One sentence for users. */
  message: string;
}

/** Both models and how they were estimated. */
export interface Geometry extends Models {
  /** One flag (0 or 1) per match, in the same order. */
  inliers: Uint8Array<ArrayBuffer>;
  report: FitReport;
}

/** How the geometry was estimated. */
export interface FitReport {
  /**
   * The model: H∞ and e' with twelve free parameters (`depth`), parametrized by rotation, translation and focal length
   * (`calibrated`), with depth from the matches alone (`two-view`), or without parallax (`homography`).
   */
  model: "depth" | "calibrated" | "two-view" | "homography";
  /** Focal length in pixels of the target, if one was estimated, given or assumed (of a camera that only turned). */
  focalLength: number | null;
  /** Number of matches. */
  matches: number;
  /** Matches without those that are not finite, outside the images, duplicates, or without depth. */
  usable: number;
  inliers: number;
  /**
   * Points tracked across the overlap (Lucas–Kanade) and fitted in addition to the matches. This is done only if the
   * depth is about as accurate as the matches, and never by `estimate`, which does not see the images.
   */
  tracked: number;
  /** The inlier threshold used, in pixels of the reference. */
  threshold: number;
  /** Number of samples drawn. */
  trials: number;
  /** Median transfer error of the inliers and the tracked points, in pixels: forward, reverse. */
  residual: [number, number];
  warnings: Warning[];
}

/** The target as seen by the reference's camera, on a canvas that contains both images. */
export interface Warped {
  warped: ImageOutput;
  /** Pixels covered by any cell of the target, including those declared void. */
  footprint: Mask;
  /**
   * With `warpMode: "soft"`, how well forward and reverse model agree on what is shown: 255 fully, 128
   * at the void distance, towards 0 beyond. Without it, all that is shown is reliable.
   */
  confidence?: Mask;
  /** Position of the reference's top left pixel on the canvas. */
  offset: { x: number; y: number };
  /** Whether part of the target was cut off by the canvas limit. */
  clipped: boolean;
}

/** The two images on one canvas. */
export interface Mosaic {
  mosaic: ImageOutput;
  /** Pixels inside the target's footprint, or in holes of the reference, that neither image covers. */
  voidMask: Mask;
  /** The image that each pixel comes from: 0 none, 1 the target, 2 the reference, 3 both. */
  seam: Mask;
  /** Exposure compensation: mean factor of the target's red, green and blue over the overlap, in linear light. */
  gains: [number, number, number];
}

/** Agreement of the images over the overlap. PSNR means nothing without coverage: dropping pixels raises it. */
export interface Quality {
  /** PSNR in dB over the bounding box of the overlap, both images black outside the overlap (the paper's measure). */
  psnrBbox: number;
  ssimBbox: number;
  /** PSNR in dB over the valid pixels only. */
  psnrMask: number;
  ssimMask: number;
  /** Valid fraction of the reference, 0 to 1. */
  coverage: number;
}

/** A rectangle in pixels. */
export interface Rect {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** The first half of `stitch`: everything that `warp` needs besides the images. */
export interface Alignment extends Geometry {
  /** xt, yt, xr, yr of every match, given or found. */
  matches: Float32Array<ArrayBuffer>;
  /** Inverse depth of the target; absent for a homography. */
  targetDepth?: DepthOutput;
  /** Inverse depth of the reference; absent for a homography. */
  referenceDepth?: DepthOutput;
  /**
   * The option to pass to `warp`: 1 where two smooth surfaces take the place of depth, as by default for two images alone; with
   * other depth from the images, down to half of the one given.
   */
  voidDistance: number;
  /**
   * Reference pixels whose refined depth is reliable (left–right check); null without refinement, with depth from the images alone,
   * and for a homography.
   */
  reliable: Mask | null;
}

/** Everything that `stitch` returns. */
export interface StitchResult extends Warped, Mosaic, Geometry {
  /** What both photos are shown on. */
  projection: "plane" | "cylinder" | "sphere";
  /**
   * Unless `projection` is `"plane"`, the reference as it is shown, transparent elsewhere: `offset` is the position of its top left
   * pixel, and it takes the photo's place wherever the mosaic or the warped target is compared with the reference.
   */
  projectedReference?: ImageOutput;
  /** Rectangles of the mosaic: the largest one without transparent pixels, and the bounding box. */
  crop: { inner: Rect | null; bounds: Rect | null };
  /** xt, yt, xr, yr of every match, given or found; `inliers` has one flag each. */
  matches: Float32Array<ArrayBuffer>;
  /** With `outputDepth`: inverse depth of the target; absent for a homography. */
  targetDepth?: DepthOutput;
  /** With `outputDepth`: inverse depth of the reference; absent for a homography. */
  referenceDepth?: DepthOutput;
  quality: Quality;
  /** Milliseconds per stage that was run. */
  times: Partial<Record<Stage, number>>;
}

/** A photo of `stitchMany`. */
export interface PhotoInput extends ImageInput {
  /** Focal length in pixels, if known to about five per cent; by default it is estimated, one for all photos. */
  readonly focalLength?: number | null | undefined;
  /**
   * Where it was taken, as results say it, if known: then that of every photo has to be, with `focalLength`, and all stay as they are.
   * The principal point is the middle of the photo.
   */
  readonly camera?:
    { readonly rotation: Float64Array; readonly translation: Float64Array } | null | undefined;
  /** Its depth, if known: up to an affine change of the inverse, or in the unit of the cameras that are given. */
  readonly depth?: DepthInput | null | undefined;
}

/** What `stitchMany` takes besides photos and options. */
export interface ManyInputs {
  /**
   * Index of the photo in whose view all are shown; by default the one in the middle, or of photos taken on the way forward an early
   * one.
   */
  readonly reference?: number | null | undefined;
  /**
   * The radial distortion of the lens, as results say it, from −1 to 1; 0 for none. By default it is estimated, but for photos with
   * a `camera`, where it is 0.
   */
  readonly distortion?: number | null | undefined;
  /** Whether the result should contain the maps of the photos, and the inverse depth that was used. Default false. */
  readonly outputDepth?: boolean | undefined;
}

/** Whether a photo is in the picture, and if not, why. */
export type PhotoCode =
  /** It is in the picture. */
  | "used"
  /** It matches none of the others. */
  | "no-matches"
  /** It matches others, but not the group of the `reference`, or else the largest. */
  | "other-group"
  /** It matches others, but they do not determine its pose. */
  | "no-pose"
  /** It looks so far to the side of the reference that it would be stretched out of shape. */
  | "too-oblique"
  /** Nothing of it is visible from the reference. */
  | "not-visible";

/** What became of one photo. */
export interface PhotoReport {
  /** Whether it is in the picture. */
  used: boolean;
  code: PhotoCode;
  /**
   * Where it was taken: X_camera = rotation · X + translation, the rotation row by row, x to the right, y down, z forward, in a
   * unit that all photos share. Null without a place, and if `geometry` is `"homographies"`.
   */
  camera: { rotation: Float64Array<ArrayBuffer>; translation: Float64Array<ArrayBuffer> } | null;
  /** In pixels; null without a camera. */
  focalLength: number | null;
  /** Median error of its matches by the geometry, in pixels; null without a place. */
  error: number | null;
  /**
   * What red, green and blue were multiplied by in linear light, on average over the overlap with the photos before it. The picture's shadows
   * may have been lifted after that.
   */
  gains: number[];
  /** The smallest rectangle around it in the picture, from `offset`; null unless used. */
  extent: Rect | null;
  /** With `outputDepth`, if it is used: from its pixels to the reference's, whatever the picture is shown on. */
  forward?: Model;
  /** The same back, by the reference's inverse depth. */
  reverse?: Model;
  /** With `outputDepth`, if it is used: its inverse depth, in the unit of `forward`; absent without parallax. */
  inverseDepth?: DepthOutput;
  /**
   * With `outputDepth`, if it is used and the lens distorts: the photo without that, at the same scale and with the same middle.
   * `forward`, `reverse` and `inverseDepth` are then of its pixels, and of the reference's without distortion.
   */
  undistorted?: ImageOutput;
}

/** Two photos that were compared. */
export interface PhotoPair {
  /** Their indices. */
  photos: number[];
  /** Matching features. */
  matches: number;
  /** Matches that agree on one geometry. */
  inliers: number;
  /**
   * Whether the two are taken to show the same scene: what ties the cameras, also by what was matched once these were known;
   * `matches` and `inliers` are those of the first comparison.
   */
  linked: boolean;
}

/** Everything that `stitchMany` returns. */
export interface StitchManyResult {
  mosaic: ImageOutput;
  /** Which photo shows: 0 none, otherwise its index plus 1. */
  labels: Mask;
  /** Pixels that photos reach but none of them covers. */
  voidMask: Mask;
  /** Position of the reference's top left pixel in the mosaic; of the rectangle around it unless `projection` is `"plane"`. */
  offset: { x: number; y: number };
  /**
   * How large the mosaic is next to the reference: 1, or ½, ¼ … where memory did not suffice for more. On a plane pixel (x, y) of the
   * reference is then at (x + ½)·scale − ½ from `offset`; where the lens distorts, to within a pixel.
   */
  scale: number;
  /** Index of the photo in whose view all are shown. */
  reference: number;
  /** What the photos are shown on. On a plane the reference stays as it is, but for `distortion`. */
  projection: "plane" | "cylinder" | "sphere";
  /**
   * Radial distortion of the lens, of all photos; 0 if none was found. What is at distance r from the middle, in diagonals of the
   * photo, would be at r/(1 + k r²) without it: below 0 it is a barrel, above a pincushion. Photos are shown without it.
   */
  distortion: number;
  /** What explains the photos: cameras in different places, cameras that turned in one place, or homographies of a flat scene. */
  geometry: "cameras" | "rotations" | "homographies";
  /** One per photo, in the order given. */
  photos: PhotoReport[];
  /** The pairs of photos that were compared. */
  pairs: PhotoPair[];
  /** Rectangles of the mosaic: the largest one without transparent pixels, and the bounding box. */
  crop: { inner: Rect | null; bounds: Rect | null };
  warnings: Warning[];
  /** Milliseconds per stage that was run. */
  times: Partial<Record<Stage, number>>;
}
