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

/** Frees arguments that were transferred here, at once instead of when garbage is collected. */
function release(args: Call["args"]): void {
  for (const buffer of buffersOf(args) as Set<ArrayBuffer & Partial<Transferable>>) {
    if (buffer.byteLength === 0) continue;
    if (buffer.transfer) buffer.transfer(0);
    else sendNowhere(buffer);
  }
}

/** A buffer of engines since 2023. */
interface Transferable {
  transfer(length: number): ArrayBuffer;
}

/** What a closed port sends is freed in Node 20; an open one would keep it until this thread is idle. */
function sendNowhere(buffer: ArrayBuffer): void {
  const { port1 } = new MessageChannel();
  port1.close();
  port1.postMessage(null, [buffer]);
}
