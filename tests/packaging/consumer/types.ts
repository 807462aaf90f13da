// Uses every export, so that a type checker sees every declaration that is published.
import * as depthstitch from "depthstitch";
import {
  blend,
  defaultOptions,
  estimate,
  fill,
  init,
  measure,
  stitch,
  StitchError,
  version,
  warp,
  type CallOptions,
  type DepthInput,
  type Depths,
  type ErrorCode,
  type ErrorStage,
  type EstimateInputs,
  type EstimateOptions,
  type FillOptions,
  type FitReport,
  type Geometry,
  type ImageInput,
  type ImageOutput,
  type Mask,
  type Model,
  type Models,
  type Mosaic,
  type Options,
  type Progress,
  type Quality,
  type Remark,
  type Settings,
  type Size,
  type Stage,
  type StitchInputs,
  type StitchOptions,
  type StitchResult,
  type Warped,
  type WarpOptions,
  type WasmSource,
} from "depthstitch";
import * as codecs from "depthstitch/codecs";

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

  const sizes: EstimateInputs = { targetSize: size, referenceSize: size, matches, ...depths };
  const fit: EstimateOptions = { ...settings, threshold: "paper" };
  const geometry: Geometry = await estimate(sizes, fit);
  const { forward, reverse }: Models = geometry;
  const model: Model = forward ?? reverse;
  const report: FitReport = geometry.report;
  const remarks: Remark[] = report.warnings;
  const rendering: WarpOptions = { ...depths, warpMode: "backward+void" };
  const warped: Warped = await warp(image, image, geometry, rendering);
  const { mosaic, voidMask }: Mosaic = await blend(warped, image, call);
  const filling: FillOptions = { fillRadius: 3 };
  const filled: ImageOutput = await fill(mosaic, voidMask satisfies Mask, filling);
  const quality: Quality = await measure(result, image);
  const text: string = await version();
  void [model, remarks, filled, quality, text];
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
  await Promise.all(files satisfies Promise<Uint8Array<ArrayBuffer>>[]);
  return { ...(await codecs.decodeDepth(file)) };
}

// Nothing may be left out above.
type Used =
  | "StitchError"
  | "blend"
  | "defaultOptions"
  | "estimate"
  | "fill"
  | "init"
  | "measure"
  | "stitch"
  | "version"
  | "warp";
type UsedCodecs =
  | "MAX_PIXELS"
  | "StitchError"
  | "decodeDepth"
  | "decodeImage"
  | "encodeGrayPng"
  | "encodeJpeg"
  | "encodePng"
  | "init";
type Nothing<T extends never> = T;
export type Missing = Nothing<Exclude<keyof typeof depthstitch, Used>>;
export type MissingCodecs = Nothing<Exclude<keyof typeof codecs, UsedCodecs>>;
// @ts-expect-error the image's width must be a number
void stitch({ ...image, width: "2" }, image);
// @ts-expect-error there is no such option
void stitch(image, image, { treshold: 3 });
