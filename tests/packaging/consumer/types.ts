// Uses every export, so that the type checker checks every published declaration.
import * as depthstitch from "depthstitch";
import {
  align,
  blend,
  crop,
  defaultOptions,
  detect,
  estimate,
  fill,
  init,
  match,
  matchImages,
  measure,
  stitch,
  StitchError,
  stitchMany,
  version,
  warp,
  type Alignment,
  type BlendOptions,
  type CallOptions,
  type DepthInput,
  type DepthOutput,
  type Depths,
  type ErrorCode,
  type ErrorStage,
  type EstimateInputs,
  type EstimateOptions,
  type Features,
  type FillOptions,
  type FitReport,
  type Geometry,
  type ImageInput,
  type ImageMatches,
  type ImageOutput,
  type Mask,
  type Matches,
  type MatchOptions,
  type Model,
  type Models,
  type Mosaic,
  type Options,
  type Output,
  type PhotoCode,
  type PhotoInput,
  type PhotoPair,
  type PhotoReport,
  type Progress,
  type Quality,
  type Rect,
  type Settings,
  type Size,
  type Stage,
  type StitchInputs,
  type StitchManyOptions,
  type StitchManyResult,
  type StitchOptions,
  type StitchResult,
  type StitchResultOf,
  type Warning,
  type WarningCode,
  type Warped,
  type WarpOptions,
  type WasmSource,
} from "depthstitch";
import * as cases from "depthstitch/cases";
import * as codecs from "depthstitch/codecs";
import codecsFile from "depthstitch/codecs.wasm";
import coreFile from "depthstitch/depthstitch.wasm";
import * as depthModels from "depthstitch/depth";
import * as inpainting from "depthstitch/inpaint";
import manyFile from "depthstitch/many.wasm";
import * as options from "depthstitch/options";

const image: ImageInput = { data: new Uint8ClampedArray(16), width: 2, height: 2 };
const depth: DepthInput = { data: new Float32Array(4), width: 2, height: 2, kind: "metric" };
const size: Size = { width: 2, height: 2 };
const matches = new Float32Array(0);
const depths: Depths = { targetDepth: depth, referenceDepth: depth };
const inputs: StitchInputs = { ...depths, matches };

export async function everyCall(signal: AbortSignal, source: WasmSource): Promise<void> {
  await init(source);
  const onProgress = ({ stage, fraction }: Progress) => void [stage satisfies Stage, fraction];
  const call: CallOptions = { signal, onProgress, worker: false, transfer: true };
  const defaults: Options = await defaultOptions();
  const settings: Settings = { ...defaults, seed: undefined };
  const options: StitchOptions = { ...settings, ...inputs, ...call };
  const result: StitchResult = await stitch(image, image, options);
  const output: Output = "mosaic";
  const part: StitchResultOf<"mosaic" | "seam"> = await stitch(image, image, {
    ...inputs,
    outputs: [output, "seam"],
  });
  // @ts-expect-error it was not asked for
  void [part.mosaic, part.seam, part.quality, part.warped];

  const matching: MatchOptions = { ...call, maxKeypoints: 1000, upsample: false };
  const features: Features = await detect(image, matching);
  const pairs: Matches = await match(features, features, matching);
  const both: ImageMatches = await matchImages(image, image, matching);

  const sizes: EstimateInputs = { targetSize: size, referenceSize: size, matches, ...depths };
  const fit: EstimateOptions = { ...settings, threshold: "paper" };
  const geometry: Geometry = await estimate(sizes, fit);
  const { forward, reverse }: Models = geometry;
  const model: Model = forward ?? reverse;
  const report: FitReport = geometry.report;
  const warnings: Warning[] = report.warnings;
  const warned: WarningCode | undefined = warnings[0]?.code;
  const aligned: Alignment = await align(image, image, options);
  const map: DepthOutput | undefined = aligned.targetDepth;
  const blending: BlendOptions = { ...call, reliable: aligned.reliable, seam: "cut" };
  const rect: Rect | null = result.crop.inner;
  if (rect) crop(result.mosaic, rect);
  const rendering: WarpOptions = { ...depths, warpMode: "backward+void" };
  const warped: Warped = await warp(image, image, geometry, rendering);
  const { mosaic, voidMask }: Mosaic = await blend(warped, image, blending);
  const filling: FillOptions = { fillRadius: 3 };
  const filled: ImageOutput = await fill(mosaic, voidMask satisfies Mask, filling);
  const quality: Quality = await measure(result, image);
  const photos: PhotoInput[] = [{ ...image, focalLength: 2 }, image, image];
  const together: StitchManyOptions = { ...settings, ...call, reference: 1 };
  const picture: StitchManyResult = await stitchMany(photos, together);
  const first: PhotoReport | undefined = picture.photos[0];
  const code: PhotoCode | undefined = first?.code;
  const compared: PhotoPair[] = picture.pairs;

  const text: string = await version();
  void [code, compared, map, pairs, both, model, warned, filled, quality, text];
}

export async function everyFileOfWasm(): Promise<void> {
  await Promise.all([init(coreFile, manyFile), codecs.init(codecsFile)]);
  // @ts-expect-error it may be the bytes
  coreFile satisfies string;
}

export function whatWentWrong(error: unknown): [ErrorCode, ErrorStage, number | undefined] | null {
  if (!(error instanceof StitchError)) return null;
  const plain: Error = error;
  void plain;
  return [error.code, error.stage, error.details.matches];
}

export async function everyCodec(file: Uint8Array): Promise<codecs.DepthMap> {
  await codecs.init();
  const picture: codecs.ImageOutput = await codecs.decodeImage(file, codecs.MAX_PIXELS);
  const input: codecs.ImageInput = picture;
  const gray: codecs.GrayInput = { data: new Uint8Array(4), ...size };
  const files = [codecs.encodePng(input), codecs.encodeJpeg(input, 80), codecs.encodeGrayPng(gray)];
  await Promise.all(files satisfies Promise<Uint8Array>[]);
  const metadata: codecs.PhotoMetadata = await codecs.readMetadata(file);
  const focalLength: number | null =
    metadata.exif && (await codecs.readFocalLength(metadata.exif, size));
  void focalLength;
  await codecs.encodePng(
    await codecs.convertColours(input, metadata.colourProfile, null),
    metadata,
  );
  return { ...(await codecs.decodeDepth(file)) };
}

export async function everyNetwork(signal: AbortSignal, weights: depthModels.Weights) {
  const heard = ({ stage, fraction }: depthModels.ModelProgress) => void [stage, fraction];
  const call: depthModels.ModelCallOptions = { signal, onProgress: heard };
  const wasmPaths: depthModels.WasmPaths = "/ort/";
  const runtime: depthModels.RuntimeOptions = { wasmPaths, threads: 1 };
  const model: depthModels.DepthModel = { id: "a/b", output: "metric" };
  const anything: depthModels.DepthModelOptions = { ...call, ...runtime, model, device: "auto" };
  const estimator: depthModels.DepthEstimator = await depthModels.loadDepthModel(anything);
  const targetDepth: depthModels.EstimatedDepth = await estimator.estimate(image, call);
  const onnx: depthModels.OnnxDepthOptions = { weights, inputSize: size, mean: [0, 0, 0] };
  const referenceDepth = await (await depthModels.loadOnnxDepth(onnx)).estimate(image);
  const output: depthModels.DepthOutput = "inverse";
  await depthModels.estimateDepth(image, { model: { id: "a/b", output } });
  const { mosaic, voidMask } = await stitch(image, image, { targetDepth, referenceDepth });

  const network: inpainting.InpaintNetwork = {
    input: "uint8",
    mask: "known",
    outputMax: 255,
    tileSize: 512,
    dilation: 5,
  };
  const options: inpainting.InpainterOptions = { ...runtime, model: network, weights };
  const inpainter: inpainting.Inpainter = await inpainting.loadInpainter(options);
  const filled: ImageOutput = await inpainter.inpaint(mosaic, voidMask, call);
  await Promise.all([estimator.dispose(), inpainter.dispose()]);
  return filled;
}

export function everyFile(text: string, bytes: Uint8Array): cases.CaseDescription | string {
  const matches: Float32Array = cases.parseMatches(text, "matches.csv");
  const { data, shape }: cases.NumericArray = cases.parseNpy(bytes, "depth.npy");
  void [matches, data, shape];
  try {
    const description = cases.parseCase(text, "case.json");
    const format: cases.DepthFormat | null = description.depth;
    const truth: cases.TrueMap | null = description.truth;
    void [format, truth];
    return description;
  } catch (error) {
    if (!(error instanceof cases.FileError)) throw error;
    const code: cases.FileErrorCode = error.code;
    return code;
  }
}

export function everyOption(): string[] {
  const one: options.NumberOption = options.OPTIONS.maxTrials;
  const choice: options.ChoiceOption = options.OPTIONS.seam;
  const flag: options.BooleanOption = options.OPTIONS.mutual;
  void [one, choice, flag];
  return options.OPTION_LIST.map(([name, spec]) => {
    const [key, { group }]: [options.OptionName, options.OptionSpec] = [name, spec];
    return `${key} ${group satisfies options.OptionGroup}`;
  });
}

// The code above must use every export.
type Used =
  | "StitchError"
  | "align"
  | "blend"
  | "crop"
  | "defaultOptions"
  | "detect"
  | "estimate"
  | "fill"
  | "init"
  | "match"
  | "matchImages"
  | "measure"
  | "stitch"
  | "stitchMany"
  | "version"
  | "warp";
type UsedCodecs =
  | "MAX_PIXELS"
  | "StitchError"
  | "convertColours"
  | "decodeDepth"
  | "decodeImage"
  | "encodeGrayPng"
  | "encodeJpeg"
  | "encodePng"
  | "init"
  | "readFocalLength"
  | "readMetadata";
type UsedDepth = "StitchError" | "estimateDepth" | "loadDepthModel" | "loadOnnxDepth";
type UsedCases = "FileError" | "parseCase" | "parseMatches" | "parseNpy";
type UsedOptions = "OPTIONS" | "OPTION_LIST";
type UsedInpaint = "StitchError" | "loadInpainter";
type Nothing<T extends never> = T;
export type Missing = Nothing<Exclude<keyof typeof depthstitch, Used>>;
export type MissingCodecs = Nothing<Exclude<keyof typeof codecs, UsedCodecs>>;
export type MissingDepth = Nothing<Exclude<keyof typeof depthModels, UsedDepth>>;
export type MissingCases = Nothing<Exclude<keyof typeof cases, UsedCases>>;
export type MissingOptions = Nothing<Exclude<keyof typeof options, UsedOptions>>;
export type MissingInpaint = Nothing<Exclude<keyof typeof inpainting, UsedInpaint>>;
// @ts-expect-error the image's width must be a number
void stitch({ ...image, width: "2" }, image);
// @ts-expect-error there is no such option
void stitch(image, image, { treshold: 3 });
