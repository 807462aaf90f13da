import type { Call, Result } from "./calls.js";
import { instance } from "./instance.js";
import type { Progress, Stage } from "./types.js";
import * as coreGlue from "./wasm/depthstitch.js";
import * as manyGlue from "./wasm/many.js";

/** The core on this thread. */
export const core = instance(coreGlue);
/** The core with what many photos need besides: two fifths more, which is loaded when it is needed. */
export const many = instance(manyGlue);

/** Names of the modules that stitch. */
export type ModuleName = "core" | "many";

/** The module that a call needs. Parts of a call for many photos are performed by the same module as the whole. */
export function moduleOf({ name }: Pick<Call, "name">): ModuleName {
  return name === "stitchMany" ? "many" : "core";
}

/** Instantiates a module on this thread. */
export function start(name: ModuleName, module: WebAssembly.Module): Promise<void> {
  return { core, many }[name].start(module);
}

/** Bytes of a module's memory on this thread, which never shrinks. */
export function memoryOf(name: ModuleName): number {
  return name === "many"
    ? many.call((raw) => raw.peakMemory())
    : core.call((raw) => raw.peakMemory());
}

/** Runs a call on a module, which must have been started. An exception in `onProgress` stops the call and is rethrown. */
export function run(
  call: Call,
  name: ModuleName,
  onProgress: (progress: Progress) => void,
): Result {
  let thrown: { error: unknown } | undefined;
  const report: Report = (stage, fraction, subject) => {
    const { photo, pair } = typeof subject === "number" ? { photo: subject } : { pair: subject };
    try {
      onProgress({ stage, fraction, ...(photo !== undefined && { photo }), ...(pair && { pair }) });
    } catch (error) {
      thrown = { error };
    }
    return thrown === undefined;
  };
  try {
    if (call.name === "stitchMany") return many.call((raw) => raw.stitchMany(...call.args, report));
    if (call.name === "affordableMany") return many.call((raw) => raw.affordableMany(...call.args));
    const work = (raw: typeof coreGlue) => invoke(raw, call, report);
    return name === "many" ? many.call(work) : core.call(work);
  } catch (error) {
    throw thrown ? thrown.error : error;
  }
}

/** Receives progress; returning `false` stops the core. */
type Report = (
  stage: Stage,
  fraction: number,
  subject: number | [number, number] | undefined,
) => boolean;

function invoke(
  raw: typeof coreGlue,
  call: Exclude<Call, { name: "stitchMany" | "affordableMany" }>,
  report: Report,
): Result {
  switch (call.name) {
    case "stitch":
      return raw.stitch(...call.args, report);
    case "detect":
      return raw.detect(...call.args, report);
    case "match":
      return raw.match(...call.args, report);
    case "matchImages":
      return raw.matchImages(...call.args, report);
    case "estimate":
      return raw.estimate(...call.args, report);
    case "align":
      return raw.align(...call.args, report);
    case "warp":
      return raw.warp(...call.args, report);
    case "blend":
      return raw.blend(...call.args, report);
    case "fill":
      return raw.fill(...call.args, report);
    case "measure":
      return raw.measure(...call.args);
    case "affordable":
      return raw.affordable(...call.args);
  }
}
