// Checks the types of arguments and turns them into plain objects that can be sent between threads. Values (sizes, ranges,
// lengths) are checked by the core, unless a function does not call it.
import { numberOfWorkers, outputs, type Workers } from "./choices.js";
import { tag, unexpected } from "./describe.js";
import { invalid, StitchError } from "./errors.js";
import type {
  BlendOptions,
  CallOptions,
  DepthInput,
  Depths,
  EstimateInputs,
  Features,
  ImageInput,
  ImageOutput,
  ManyInputs,
  Mask,
  MeasureOptions,
  Model,
  Models,
  Options,
  PhotoInput,
  Rect,
  Size,
  StitchInputs,
  Warped,
} from "./types.js";

// Typed arrays of another realm (an iframe, a test environment) are accepted, so their class is read from their tag; the
// result is a view of this realm. Shared memory is copied, as it could change during the call.
const views = {
  Uint8Array: (v: ArrayBufferView) => new Uint8Array(...extent(v, 1)),
  Uint8ClampedArray: (v: ArrayBufferView) => new Uint8ClampedArray(...extent(v, 1)),
  Uint16Array: (v: ArrayBufferView) => new Uint16Array(...extent(v, 2)),
  Float32Array: (v: ArrayBufferView) => new Float32Array(...extent(v, 4)),
  Float64Array: (v: ArrayBufferView) => new Float64Array(...extent(v, 8)),
};
type Kind = keyof typeof views;

/**
 * What `inputs` makes of arguments. Whatever reading them throws (a revoked proxy, a getter) becomes an `invalid-argument`
 * error with that as its cause.
 */
export function read<T>(inputs: () => T): T {
  try {
    return inputs();
  } catch (cause) {
    if (cause instanceof StitchError) throw cause;
    const reason = cause instanceof Error ? `: ${cause.message}` : "";
    throw invalid(`an argument cannot be read${reason}`, {}, { cause });
  }
}

function extent(view: ArrayBufferView, bytes: number): [ArrayBuffer, number, number] {
  const { buffer, byteOffset, byteLength } = view;
  const length = byteLength / bytes;
  if (tag(buffer) !== "SharedArrayBuffer") return [buffer as ArrayBuffer, byteOffset, length];
  return [new Uint8Array(buffer, byteOffset, byteLength).slice().buffer as ArrayBuffer, 0, length];
}

function view<K extends Kind>(
  name: string,
  value: unknown,
  ...kinds: K[]
): ReturnType<(typeof views)[K]>;
function view(name: string, value: unknown, ...kinds: Kind[]): ReturnType<(typeof views)[Kind]> {
  const kind = kinds.find((kind) => kind === tag(value));
  if (!kind || !ArrayBuffer.isView(value)) {
    throw unexpected(`${name} must be a ${kinds.join(" or ")}`, value);
  }
  try {
    return views[kind](value);
  } catch (cause) {
    throw invalid(`${name} has a buffer that was transferred or shrunk`, {}, { cause });
  }
}

export function object(name: string, value: unknown): Record<string, unknown> {
  if (typeof value !== "object" || value === null) {
    throw unexpected(`${name} must be an object`, value);
  }
  return value as Record<string, unknown>;
}

export function number(name: string, value: unknown): number {
  if (typeof value !== "number") throw unexpected(`${name} must be a number`, value);
  return value;
}

export function text(name: string, value: unknown): string {
  if (typeof value !== "string") throw unexpected(`${name} must be a string`, value);
  return value;
}

export function boolean(name: string, value: unknown): boolean {
  if (typeof value !== "boolean") throw unexpected(`${name} must be true or false`, value);
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

/** The photos of `stitchMany`. */
export function photos(value: unknown): PhotoInput[] {
  if (!Array.isArray(value)) throw unexpected("photos must be an array", value);
  // Unlike `map` it calls for holes, too.
  return Array.from(value, (photo: unknown, i) => {
    const name = `photos[${i}]`;
    const { focalLength, camera, depth: map } = object(name, photo);
    return {
      ...image(name, photo),
      ...(isGiven(focalLength) && { focalLength: number(`${name}.focalLength`, focalLength) }),
      ...(isGiven(camera) && { camera: pose(`${name}.camera`, camera) }),
      ...(isGiven(map) && { depth: depth(`${name}.depth`, map) }),
    };
  });
}

function pose(name: string, value: unknown): NonNullable<PhotoInput["camera"]> {
  const { rotation, translation } = object(name, value);
  return {
    rotation: view(`${name}.rotation`, rotation, "Float64Array"),
    translation: view(`${name}.translation`, translation, "Float64Array"),
  };
}

/** The inputs of `stitchMany` besides the photos. */
export function manyInputs(inputs: ManyInputs): ManyInputs {
  const { reference, distortion, outputDepth = false } = inputs;
  return {
    ...(isGiven(reference) && { reference: number("reference", reference) }),
    ...(isGiven(distortion) && { distortion: number("distortion", distortion) }),
    outputDepth: boolean("outputDepth", outputDepth),
  };
}

export function bytes(name: string, value: unknown): Uint8Array {
  if (tag(value) !== "ArrayBuffer") return view(name, value, "Uint8Array");
  try {
    return new Uint8Array(value as ArrayBuffer);
  } catch (cause) {
    throw invalid(`${name} is no ArrayBuffer, or was transferred`, {}, { cause });
  }
}

function output(name: string, value: unknown): ImageOutput {
  const data = view(`${name}.data`, object(name, value).data, "Uint8ClampedArray");
  return { data, ...size(name, value) };
}

export function mask(name: string, value: unknown): Mask {
  const data = view(`${name}.data`, object(name, value).data, "Uint8Array");
  return { data, ...size(name, value) };
}

/** An image whose size is valid and whose buffer has the length that the size implies. */
export function wholeImage(name: string, value: unknown): ImageInput {
  return sized(name, image(name, value), 4);
}

/** `value` if its size is valid and its buffer has the length that the size implies. */
export function sized<T extends Size & { readonly data: ArrayLike<number> }>(
  name: string,
  value: T,
  channels: number,
): T {
  positive(`${name}.width`, value.width);
  positive(`${name}.height`, value.height);
  const expected = channels * value.width * value.height;
  const actual = value.data.length;
  if (actual === expected) return value;
  const message = `${name}.data has ${actual} values, its size implies ${expected}`;
  const details = { expected, actual };
  throw new StitchError({ code: "size-mismatch", stage: "input", message, details });
}

/** An integer of at least 1. */
export function positive(name: string, value: unknown): number {
  return integer(name, value, 1);
}

/** An integer of at least 0. */
export function count(name: string, value: unknown): number {
  return integer(name, value, 0);
}

function integer(name: string, value: unknown, least: number): number {
  if (typeof value === "number" && Number.isInteger(value) && value >= least) return value;
  throw unexpected(`${name} must be an integer of at least ${least}`, value);
}

/** A rectangle that lies within an image. */
export function rectWithin(value: unknown, { width, height }: Size): Rect {
  const given = object("rect", value);
  const rect = {
    x: count("rect.x", given.x),
    y: count("rect.y", given.y),
    width: positive("rect.width", given.width),
    height: positive("rect.height", given.height),
  };
  for (const [name, end, limit] of [
    ["rect.x + rect.width", rect.x + rect.width, width],
    ["rect.y + rect.height", rect.y + rect.height, height],
  ] as const) {
    if (end > limit) throw unexpected(`${name} must be at most ${limit}`, end);
  }
  return rect;
}

function depth(name: string, value: unknown): DepthInput {
  const { data, kind, invalid: hole } = object(name, value);
  if (kind !== "inverse" && kind !== "metric") {
    throw unexpected(`${name}.kind must be "inverse" or "metric"`, kind);
  }
  return {
    data: view(`${name}.data`, data, "Float32Array", "Uint16Array", "Uint8Array"),
    ...size(name, value),
    kind,
    invalid: hole === undefined || hole === null ? null : number(`${name}.invalid`, hole),
  };
}

/** The depth maps that are given; null stands for none. */
export function depths(value: Depths): Depths {
  const { targetDepth, referenceDepth } = value;
  return {
    ...(isGiven(targetDepth) && { targetDepth: depth("targetDepth", targetDepth) }),
    ...(isGiven(referenceDepth) && { referenceDepth: depth("referenceDepth", referenceDepth) }),
  };
}

function isGiven(value: unknown): boolean {
  return value !== undefined && value !== null;
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
  const { warped, footprint, confidence, offset, clipped } = object("warped", value);
  const { x, y } = object("offset", offset);
  return {
    warped: output("warped", warped),
    footprint: mask("footprint", footprint),
    ...(confidence !== undefined && { confidence: mask("confidence", confidence) }),
    offset: { x: number("offset.x", x), y: number("offset.y", y) },
    clipped: clipped === true,
  };
}

/** The gains of `measure`, which has no options of the algorithm. */
export function gains(options: MeasureOptions): readonly number[] | undefined {
  const [other] = Object.keys(settings(options, "gains"));
  if (other !== undefined) throw noOption(other);
  return options.gains === undefined ? undefined : triple("gains", options.gains, 0);
}

/** Finite numbers above a limit for red, green and blue. */
export function triple(name: string, value: unknown, limit = -Infinity): number[] {
  if (!Array.isArray(value)) throw unexpected(`${name} must be three numbers`, value);
  if (value.length !== 3) {
    const details = { expected: 3, actual: value.length };
    throw invalid(`${name} must be three numbers, got ${value.length}`, details);
  }
  return Array.from(value, (part: unknown, i) => {
    const found = number(`${name}[${i}]`, part);
    if (found > limit && found < Infinity) return found;
    const range = limit === -Infinity ? "finite" : `finite and above ${limit}`;
    throw unexpected(`${name}[${i}] must be ${range}`, found);
  });
}

/** What some calls take in their options besides those of the algorithm. */
type Input = keyof StitchInputs | keyof ManyInputs | keyof BlendInputs | "gains";
const INPUTS: ReadonlySet<string> = new Set<Input>([
  "reference",
  "distortion",
  "matches",
  "targetDepth",
  "referenceDepth",
  "outputDepth",
  "outputs",
  "reliable",
  "gains",
]);
/** What the options of every call say of how it is run. */
const HOW: ReadonlySet<string> = new Set<keyof CallOptions>([
  "onProgress",
  "signal",
  "worker",
  "workers",
  "transfer",
]);

/** The options of the algorithm among `options`, which have these inputs as well. */
export function settings(options: object, ...inputs: Input[]): Partial<Options> {
  const own: ReadonlySet<string> = new Set(inputs);
  const set = Object.entries(object("options", options)).filter(
    ([name, value]) => value !== undefined && !HOW.has(name) && !own.has(name),
  );
  for (const [name, value] of set) {
    // The core knows the names of all others.
    if (INPUTS.has(name)) throw noOption(name);
    if (!["number", "string", "boolean"].includes(typeof value)) {
      throw unexpected(`${name} must be a number, a string or a boolean`, value);
    }
  }
  return Object.fromEntries(set);
}

function noOption(name: string): StitchError {
  return invalid(`there is no option ${name}`);
}

/** The inputs of `stitch` besides the images. */
export function stitchInputs(value: StitchInputs): StitchInputs {
  const { outputDepth = false, outputs: parts } = value;
  return {
    ...(parts !== undefined && { outputs: outputs(parts) }),
    ...(isGiven(value.matches) && { matches: matches(value.matches) }),
    ...depths(value),
    outputDepth: boolean("outputDepth", outputDepth),
  };
}

type BlendInputs = Pick<BlendOptions, "reliable">;

/** The inputs of `blend` besides the images. */
export function blendInputs(value: BlendInputs): BlendInputs {
  const { reliable } = object("options", value);
  return isGiven(reliable) ? { reliable: mask("reliable", reliable) } : {};
}

/** The options of how to run a call, with their defaults. */
export function callOptions(
  options: CallOptions,
): CallOptions & { worker: boolean; workers: Workers; transfer: boolean } {
  const given = object("options", options);
  const { onProgress, signal, worker = true, workers = "auto", transfer = false } = given;
  if (onProgress !== undefined && typeof onProgress !== "function") {
    throw unexpected("onProgress must be a function", onProgress);
  }
  if (signal !== undefined && tag(signal) !== "AbortSignal") {
    throw unexpected("signal must be an AbortSignal", signal);
  }
  return {
    onProgress: onProgress as CallOptions["onProgress"],
    signal: signal as CallOptions["signal"],
    worker: boolean("worker", worker),
    workers: numberOfWorkers(workers),
    transfer: boolean("transfer", transfer),
  };
}
