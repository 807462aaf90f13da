import type { Call, Result } from "../calls.js";
import { run, start, type ModuleName } from "../core.js";
import type { ErrorRecord } from "../errors.js";
import { recordOf } from "../instance.js";
import { buffersOf } from "../transfer.js";
import type { Progress } from "../types.js";

/** A message to the worker: one call, with the compiled module so that the worker need not load it. */
export interface Request {
  name: ModuleName;
  module: WebAssembly.Module;
  call: Call;
  /** Whether the arguments are to come back with the reply. */
  handBack: boolean;
}

/** A message from the worker: `ready` once its script is loaded; for each call any number of `progress`, then `result` or `error`. */
export type Reply =
  | { ready: true }
  | { progress: Progress }
  | { result: Result; args?: Call["args"] }
  | { error: ErrorRecord; args?: Call["args"] };

/** Handles one request. */
export async function serve(
  { name, module, call, handBack }: Request,
  post: (reply: Reply, transfer: ArrayBuffer[]) => void,
): Promise<void> {
  const back = handBack ? { args: call.args } : {};
  const send = (reply: Reply) => post(reply, [...buffersOf(reply)]);
  try {
    await start(name, module);
    const result = run(call, name, (progress) => post({ progress }, []));
    send({ result, ...back });
  } catch (error) {
    send({ error: recordOf(error), ...back });
  }
}
