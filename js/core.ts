import type { Call, Result } from "./calls.js";
import { instance } from "./instance.js";
import type { Progress, Stage } from "./types.js";
import * as glue from "./wasm/depthstitch.js";

/** The core on this thread. */
export const core = instance(glue);

/** Runs a call on the core, which must have been started. An exception in `onProgress` stops the call and is rethrown. */
export function run(call: Call, onProgress: (progress: Progress) => void): Result {
  let last: Progress = { stage: "input", fraction: -1 };
  let thrown: { error: unknown } | undefined;
  const report: Report = (stage, fraction) => {
    // The core reports often; a hundred times per stage is enough.
    if (stage === last.stage && fraction < 1 && fraction - last.fraction < 0.01) return true;
    last = { stage, fraction };
    try {
      onProgress(last);
    } catch (error) {
      thrown = { error };
    }
    return thrown === undefined;
  };
  try {
    return core.call((raw) => invoke(raw, call, report));
  } catch (error) {
    throw thrown ? thrown.error : error;
  }
}

/** Receives progress; returning `false` stops the core. */
type Report = (stage: Stage, fraction: number) => boolean;

function invoke(raw: typeof glue, call: Call, report: Report): Result {
  switch (call.name) {
    case "stitch":
      return raw.stitch(...call.args, report);
    case "stitchMany":
      return raw.stitchMany(...call.args, report);
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
  }
}
