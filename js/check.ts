// Checks the types of what a caller passed and makes plain objects of it that can change threads. Values (sizes,
// ranges, lengths) are the core's to check, in one place for every way to reach it.
import { invalid } from "./errors.js";
import type {
  CallOptions,
  DepthInput,
  Depths,
  EstimateInputs,
  Features,
  ImageInput,
  ImageOutput,
  Mask,
  Model,
  Models,
  Options,
  Size,
  StitchInputs,
  Warped,
} from "./types.js";

// Arrays of another realm (an iframe, a test environment) are as good as ours, so their kind is read from their tag;
// they come out as views of this realm. Shared memory is copied: what a call works on must not change under it.
const views = {
  Uint8Array: (v: ArrayBufferView) => new Uint8Array(...extent(v, 1)),
  Uint8ClampedArray: (v: ArrayBufferView) => new Uint8ClampedArray(...extent(v, 1)),
  Uint16Array: (v: ArrayBufferView) => new Uint16Array(...extent(v, 2)),
  Float32Array: (v: ArrayBufferView) => new Float32Array(...extent(v, 4)),
  Float64Array: (v: ArrayBufferView) => new Float64Array(...extent(v, 8)),
};
type Kind = keyof typeof views;

function extent(view: ArrayBufferView, bytes: number): [ArrayBuffer, number, number] {
  const { buffer, byteOffset, byteLength } = view;
  const length = byteLength / bytes;
  if (tag(buffer) !== "SharedArrayBuffer") return [buffer as ArrayBuffer, byteOffset, length];
  return [new Uint8Array(buffer, byteOffset, byteLength).slice().buffer as ArrayBuffer, 0, length];
}

function tag(value: unknown): string {
  return Object.prototype.toString.call(value).slice(8, -1);
}

function view<K extends Kind>(
  name: string,
  value: unknown,
  ...kinds: K[]
): ReturnType<(typeof views)[K]>;
function view(name: string, value: unknown, ...kinds: Kind[]): ReturnType<(typeof views)[Kind]> {
  const kind = kinds.find((kind) => kind === tag(value));
  if (!kind || !ArrayBuffer.isView(value)) {
    throw invalid(`${name} must be a ${kinds.join(" or ")}, got ${describe(value)}`);
  }
  return views[kind](value);
}

function describe(value: unknown): string {
  return typeof value === "object" ? tag(value) : typeof value;
}

function object(name: string, value: unknown): Record<string, unknown> {
  if (typeof value !== "object" || value === null) {
    throw invalid(`${name} must be an object, got ${describe(value)}`);
  }
  return value as Record<string, unknown>;
}

function number(name: string, value: unknown): number {
  if (typeof value !== "number") throw invalid(`${name} must be a number, got ${describe(value)}`);
  return value;
}

function boolean(name: string, value: unknown): boolean {
  if (typeof value !== "boolean")
    throw invalid(`${name} must be true or false, got ${describe(value)}`);
  return value;
}

export function size(name: string, value: unknown): Size {
  const { width, height } = object(name, value);
  return { width: number(`${name}.width`, width), height: number(`${name}.height`, height) };
}

export function image(name: string, value: unknown): ImageInput {
  const data = view(`${name}.data`, object(name, value).data, "Uint8ClampedArray", "Uint8Array");
  return { data, ...size(name, value) };
}

export function bytes(name: string, value: unknown): Uint8Array {
  return tag(value) === "ArrayBuffer"
    ? new Uint8Array(value as ArrayBuffer)
    : view(name, value, "Uint8Array");
}

function output(name: string, value: unknown): ImageOutput {
  const data = view(`${name}.data`, object(name, value).data, "Uint8ClampedArray");
  return { data, ...size(name, value) };
}

export function mask(name: string, value: unknown): Mask {
  const data = view(`${name}.data`, object(name, value).data, "Uint8Array");
  return { data, ...size(name, value) };
}

function depth(name: string, value: unknown): DepthInput {
  const { data, kind, invalid: hole } = object(name, value);
  if (kind !== "inverse" && kind !== "metric") {
    throw invalid(`${name}.kind must be "inverse" or "metric", got ${String(kind)}`);
  }
  return {
    data: view(`${name}.data`, data, "Float32Array", "Uint16Array", "Uint8Array"),
    ...size(name, value),
    kind,
    invalid: hole === undefined || hole === null ? null : number(`${name}.invalid`, hole),
  };
}

/** Those of the two depth maps that are there. */
export function depths(value: Depths): Depths {
  const { targetDepth, referenceDepth } = value;
  return {
    ...(targetDepth !== undefined && { targetDepth: depth("targetDepth", targetDepth) }),
    ...(referenceDepth !== undefined && {
      referenceDepth: depth("referenceDepth", referenceDepth),
    }),
  };
}

export function features(name: string, value: unknown): Features {
  const { keypoints, descriptors } = object(name, value);
  return {
    keypoints: view(`${name}.keypoints`, keypoints, "Float32Array"),
    descriptors: view(`${name}.descriptors`, descriptors, "Uint8Array"),
    ...size(name, value),
  };
}

export function matches(value: unknown): Float32Array {
  return view("matches", value, "Float32Array");
}

export function estimateInputs(value: EstimateInputs): EstimateInputs {
  object("inputs", value);
  return {
    targetSize: size("targetSize", value.targetSize),
    referenceSize: size("referenceSize", value.referenceSize),
    matches: matches(value.matches),
    ...depths(value),
  };
}

function model(name: string, value: unknown): Model {
  const { h, e } = object(name, value);
  return { h: view(`${name}.h`, h, "Float64Array"), e: view(`${name}.e`, e, "Float64Array") };
}

export function models(value: Models): Models {
  const { forward, reverse } = object("geometry", value);
  return { forward: model("forward", forward), reverse: model("reverse", reverse) };
}

export function warped(value: Warped): Warped {
  const { warped, footprint, offset, clipped } = object("warped", value);
  const { x, y } = object("offset", offset);
  return {
    warped: output("warped", warped),
    footprint: mask("footprint", footprint),
    offset: { x: number("offset.x", x), y: number("offset.y", y) },
    clipped: clipped === true,
  };
}

/** What an options object holds beside the core's own settings. */
const notSettings = new Set(
  "matches targetDepth referenceDepth outputDepth trusted onProgress signal worker transfer".split(
    " ",
  ),
);

/** The core's settings among `options`. */
export function settings(options: object): Partial<Options> {
  const set = Object.entries(object("options", options)).filter(
    ([name, value]) => value !== undefined && !notSettings.has(name),
  );
  for (const [name, value] of set) {
    if (!["number", "string", "boolean"].includes(typeof value)) {
      throw invalid(`${name} must be a number, a string or a boolean, got ${describe(value)}`);
    }
  }
  return Object.fromEntries(set);
}

/** What `stitch` takes besides the photos. */
export function stitchInputs(value: StitchInputs): StitchInputs {
  const { outputDepth = false } = value;
  return {
    ...(value.matches !== undefined && { matches: matches(value.matches) }),
    ...depths(value),
    outputDepth: boolean("outputDepth", outputDepth),
  };
}

/** How to run a call. */
export function callOptions(options: CallOptions): CallOptions {
  const { onProgress, signal, worker = true, transfer = false } = object("options", options);
  if (onProgress !== undefined && typeof onProgress !== "function") {
    throw invalid(`onProgress must be a function, got ${describe(onProgress)}`);
  }
  if (signal !== undefined && tag(signal) !== "AbortSignal") {
    throw invalid(`signal must be an AbortSignal, got ${describe(signal)}`);
  }
  boolean("worker", worker);
  boolean("transfer", transfer);
  return options;
}
