import type { Call, Result } from "./calls.js";
import { instance } from "./instance.js";
import type { Progress, Stage } from "./types.js";
import * as glue from "./wasm/depthstitch.js";

/** The core on this thread. */
export const core = instance(glue);

/** Makes the call on the core, which has been started. */
export function run(call: Call, onProgress: (progress: Progress) => void): Result {
  let last: Progress = { stage: "input", fraction: -1 };
  const report = (stage: Stage, fraction: number) => {
    // The core reports as often as it can; a hundred times per stage is enough.
    if (stage === last.stage && fraction < 1 && fraction - last.fraction < 0.01) return;
    last = { stage, fraction };
    onProgress(last);
  };
  return core.call((raw) => invoke(raw, call, report));
}

function invoke(
  raw: typeof glue,
  call: Call,
  report: (stage: Stage, fraction: number) => void,
): Result {
  switch (call.name) {
    case "stitch":
      return raw.stitch(...call.args, report);
    case "estimate":
      return raw.estimate(...call.args, report);
    case "warp":
      return raw.warp(...call.args, report);
    case "blend":
      return raw.blend(...call.args);
    case "fill":
      return raw.fill(...call.args, report);
    case "measure":
      return raw.measure(...call.args);
  }
}
