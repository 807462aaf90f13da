import type { Call, CallName, Result } from "../calls.js";
import { memoryOf, run, start, type ModuleName } from "../core.js";
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

/**
 * A message from the worker: `ready` once its script is loaded; for each call any number of `progress`, then `result`, with the bytes of
 * memory that the module has taken, or `error`.
 */
export type Reply =
  | { ready: true }
  | { progress: Progress }
  | { result: Result; memory: number; args?: Call["args"] }
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
    const result = run(call, name, (progress) => {
      if (!handBack && progress.stage !== "input" && WHOLE.has(call.name)) release(call.args);
      post({ progress }, []);
    });
    send({ result, memory: memoryOf(name), ...back });
  } catch (error) {
    send({ error: recordOf(error), ...back });
  }
}

/** Calls that have copied all of their arguments before they report any stage but the first. */
const WHOLE: ReadonlySet<CallName> = new Set(["stitch", "align", "stitchMany"]);

/**
 * Frees arguments that were transferred here, at once instead of when garbage is collected, by sending them nowhere. Node frees what
 * a closed port sends, and keeps what an open one does until this thread is idle; Chromium has a closed port send nothing.
 * (`ArrayBuffer.prototype.transfer` would not do: Chromium keeps what another thread has sent.)
 */
function release(args: Call["args"]): void {
  const { port1, port2 } = new MessageChannel();
  const send = (port: MessagePort) => {
    const buffers = [...buffersOf(args)].filter(({ byteLength }) => byteLength > 0);
    port.postMessage(null, buffers);
    port.close();
  };
  const closed = new MessageChannel().port1;
  closed.close();
  send(closed);
  send(port1);
  port2.close();
}
