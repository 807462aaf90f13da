import { callback } from "./callback.js";
import type { Call, Result, SharedCall } from "./calls.js";
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
  return onModule(name, (raw) => raw.peakMemory());
}

/** Other workers that take tasks of a call. */
export interface Others {
  readonly count: number;
  /** Has one of them perform a task. Where that fails, the whole call does. */
  perform(task: Call): Promise<Result>;
}

/**
 * Runs a call on a module, which must have been started. An exception in `onProgress` stops the call and is rethrown. Others take tasks of it,
 * if there are any: its result is the same, byte by byte.
 */
export async function run(
  call: Call,
  name: ModuleName,
  onProgress: (progress: Progress) => void,
  others?: Others,
): Promise<Result> {
  const told = callback(onProgress);
  const report: Report = (stage, fraction, subject) => {
    const { photo, pair } = typeof subject === "number" ? { photo: subject } : { pair: subject };
    const about = { ...(photo !== undefined && { photo }), ...(pair && { pair }) };
    return told.call({ stage, fraction, ...about });
  };
  try {
    if (isShared(call)) return await share(call, name, report, others);
    if (call.name === "matchPhotos")
      return many.call((raw) => raw.matchPhotos(...call.args, report));
    if (call.name === "matchStereo")
      return many.call((raw) => raw.matchStereo(...call.args, report));
    return onModule(name, (raw) => invoke(raw, call, report));
  } catch (error) {
    told.rethrow();
    throw error;
  }
}

/** Receives progress; returning `false` stops the core. */
type Report = (
  stage: Stage,
  fraction: number,
  subject: number | [number, number] | undefined,
) => boolean;

function onModule<T>(name: ModuleName, work: (raw: typeof coreGlue) => T): T {
  return name === "many" ? many.call(work) : core.call(work);
}

function isShared(call: Call): call is SharedCall {
  return call.name === "stitch" || call.name === "align" || call.name === "stitchMany";
}

/** Performs a call step by step. Between steps messages arrive. */
async function share(
  call: SharedCall,
  name: ModuleName,
  report: Report,
  others: Others | undefined,
): Promise<Result> {
  const options = call.args.at(-1);
  let failed: { error: unknown } | undefined;
  let wake = () => {};
  const perform = (task: string, args: unknown[]) => {
    const outcome: { result?: Result } = {};
    others
      ?.perform({ name: task, args: [...args, options] } as Call)
      .then((result) => (outcome.result = result))
      .catch((error: unknown) => (failed = { error }))
      .finally(() => wake());
    return outcome;
  };
  const workers = others && { others: others.count, perform };
  const begin = () => {
    if (call.name === "stitchMany")
      return many.call((raw) => raw.stitchMany(...call.args, report, workers));
    const [target, reference, inputs, options] = call.args;
    return onModule(name, (raw) =>
      raw[call.name](target, reference, inputs, options, report, workers),
    );
  };
  const running = begin();
  for (;;) {
    if (failed) throw failed.error;
    const result = onModule(name, () => running.step() as Result | undefined);
    if (result !== undefined) {
      running.free();
      return result;
    }
    await new Promise<void>((resolve) => {
      wake = resolve;
      if (!running.waits) setTimeout(resolve);
    });
  }
}

function invoke(
  raw: typeof coreGlue,
  call: Exclude<Call, SharedCall | { name: "matchPhotos" | "matchStereo" }>,
  report: Report,
): Result {
  switch (call.name) {
    case "detect":
      return raw.detect(...call.args, report);
    case "match":
      return raw.match(...call.args, report);
    case "matchImages":
      return raw.matchImages(...call.args, report);
    case "estimate":
      return raw.estimate(...call.args, report);
    case "warp":
      return raw.warp(...call.args, report);
    case "blend":
      return raw.blend(...call.args, report);
    case "fill":
      return raw.fill(...call.args, report);
    case "measure":
      return raw.measure(...call.args, report);
  }
}
