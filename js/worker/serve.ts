import type { Call, Result } from "../calls.js";
import { run, start } from "../core.js";
import type { ErrorRecord } from "../errors.js";
import { recordOf } from "../instance.js";
import { buffersOf } from "../transfer.js";
import type { Progress } from "../types.js";

/** A message to the worker: one call, with the compiled module so that the worker need not load it. */
export interface Request {
  module: WebAssembly.Module;
  call: Call;
}

/** A message from the worker: `ready` once its script is loaded; for each call any number of `progress`, then `result` or `error`. */
export type Reply =
  { ready: true } | { progress: Progress } | { result: Result } | { error: ErrorRecord };

/** Handles one request. */
export async function serve(
  { module, call }: Request,
  post: (reply: Reply, transfer: ArrayBuffer[]) => void,
): Promise<void> {
  try {
    await start(call, module);
    const result = run(call, (progress) => post({ progress }, []));
    post({ result }, [...buffersOf(result)]);
  } catch (error) {
    post({ error: recordOf(error) }, []);
  }
}
