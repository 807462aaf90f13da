import type { Call, CallName, Result } from "../calls.js";
import { memoryOf, run, start, type ModuleName } from "../core.js";
import { isFatal, type ErrorRecord } from "../errors.js";
import { recordOf } from "../instance.js";
import { buffersOf } from "../transfer.js";
import type { Progress } from "../types.js";

/** A call, with the compiled module so that the worker need not load it. */
export interface Request {
  name: ModuleName;
  module: WebAssembly.Module;
  call: Call;
  /** How many other workers may take tasks of it. */
  others: number;
}

/** A message to the worker: a call, or what became of a task that it left to others. */
export type Message = Request | { task: number; result: Result };

/**
 * A message from the worker: `ready` once its script is loaded; for each call any number of `progress`, and of `task` for others; then `result`
 * or `error`, with the bytes of memory that the module has taken.
 */
export type Reply =
  | { ready: true }
  | { progress: Progress }
  | { task: number; call: Call }
  | { result: Result; memory: number }
  | { error: ErrorRecord; memory: number };

/** The tasks that others perform, by their number: who waits for the result. */
const tasks = new Map<number, (result: Result) => void>();
let numbered = 0;

/** Handles one message. */
export async function serve(
  message: Message,
  post: (reply: Reply, transfer: ArrayBuffer[]) => void,
): Promise<void> {
  if ("task" in message) {
    tasks.get(message.task)?.(message.result);
    tasks.delete(message.task);
    return;
  }
  const { name, module, call, others } = message;
  const send = (reply: Reply) => post(reply, [...buffersOf(reply)]);
  const perform = (call: Call) =>
    new Promise<Result>((resolve) => {
      tasks.set(++numbered, resolve);
      send({ task: numbered, call });
    });
  try {
    await start(name, module);
    let held = COPYING.has(call.name);
    const onProgress = (progress: Progress) => {
      if (held && progress.stage !== "input") {
        release(call.args);
        held = false;
      }
      post({ progress }, []);
    };
    const result = await run(call, name, onProgress, { count: others, perform });
    send({ result, memory: memoryOf(name) });
  } catch (error) {
    const record = recordOf(error);
    // After a fatal one, asking would start the module afresh in a thread that is about to end.
    send({ error: record, memory: isFatal(record) ? 0 : memoryOf(name) });
  }
}

/** Calls that have copied all of their arguments before they report any stage but the first. */
const COPYING: ReadonlySet<CallName> = new Set([
  "stitch",
  "align",
  "stitchMany",
  "detect",
  "matchStereo",
]);

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
