import type { Call, Result } from "../calls.js";
import { core, run } from "../core.js";
import type { ErrorRecord } from "../errors.js";
import { recordOf } from "../instance.js";
import { buffersOf } from "../own.js";
import type { Progress } from "../types.js";

/** What the host sends: one call at a time. The compiled module comes along, so the worker loads nothing. */
export interface Request {
  module: WebAssembly.Module;
  call: Call;
}

/** What the worker says: `ready` when its script has been loaded; for a call any number of `progress`, then `result` or `error`. */
export type Reply =
  { ready: true } | { progress: Progress } | { result: Result } | { error: ErrorRecord };

/** Works on one request. */
export async function serve(
  { module, call }: Request,
  post: (reply: Reply, transfer: ArrayBuffer[]) => void,
): Promise<void> {
  try {
    await core.start(module);
    const result = run(call, (progress) => post({ progress }, []));
    post({ result }, [...buffersOf(result)]);
  } catch (error) {
    post({ error: recordOf(error) }, []);
  }
}
