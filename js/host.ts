// One worker that runs one call at a time, in order: two concurrent calls would need twice the memory. Aborting a running
// call terminates the worker, as nothing else can stop wasm; the next call starts a new one.
import { spawn, type Port } from "./platform/index.js";
import type { Call, Result } from "./calls.js";
import { moduleOf, type ModuleName } from "./core.js";
import { abortError, StitchError } from "./errors.js";
import type { CallOptions } from "./types.js";
import { loadError } from "./load.js";
import { buffersOf } from "./transfer.js";
import type { Reply } from "./worker/serve.js";

/** Milliseconds after which an idle worker is terminated, which releases its memory. */
const IDLE_MS = 10_000;

/** How a call ended. What `onProgress` throws may be anything. */
type Outcome = { result: Result } | { error: unknown };

interface Job {
  call: Call;
  compile: () => Promise<WebAssembly.Module>;
  onProgress: CallOptions["onProgress"];
  settle: (outcome: Outcome) => void;
}

const queue: Job[] = [];
let active: Job | undefined;
let port: Port | undefined;
/** The module that the worker has instantiated, whose memory does not shrink: another one gets a new worker. */
let loaded: ModuleName | undefined;
let idle: ReturnType<typeof setTimeout> | undefined;

/** Runs the call in the worker. The buffers in `call` are transferred. */
export function runInWorker(
  call: Call,
  compile: () => Promise<WebAssembly.Module>,
  { onProgress, signal }: CallOptions,
): Promise<Result> {
  return new Promise((resolve, reject) => {
    const onAbort = () => signal && finish(job, { error: abortError(signal) });
    const job: Job = {
      call,
      compile,
      onProgress,
      settle(outcome) {
        signal?.removeEventListener("abort", onAbort);
        if ("error" in outcome) reject(outcome.error);
        else resolve(outcome.result);
      },
    };
    signal?.addEventListener("abort", onAbort);
    queue.push(job);
    void next();
  });
}

/** Starts the next call unless one is running. */
async function next(): Promise<void> {
  if (active) return;
  const job = (active = queue.shift());
  if (!job) return;
  clearTimeout(idle);
  try {
    const module = await job.compile();
    if (active !== job) return;
    if (loaded !== moduleOf(job.call)) stop();
    loaded = moduleOf(job.call);
    port ??= start();
    port.busy(true);
    port.post({ module, call: job.call }, [...buffersOf(job.call.args)]);
  } catch (cause) {
    const known = cause instanceof StitchError;
    finish(job, { error: known ? cause : loadError("could not start the worker", cause) });
  }
}

/** Settles a call, running or queued, with its result or error. */
function finish(job: Job, outcome: Outcome): void {
  if (active === job) {
    active = undefined;
    if (!("error" in outcome) || reusable(outcome.error)) rest();
    else stop();
  } else {
    const position = queue.indexOf(job);
    if (position < 0) return;
    queue.splice(position, 1);
  }
  job.settle(outcome);
  void next();
}

/** Whether the worker is still usable after this error. */
function reusable(error: unknown): boolean {
  const fatal = ["aborted", "internal", "load-failed", "out-of-memory"];
  return error instanceof StitchError && !fatal.includes(error.code);
}

function start(): Port {
  let ready = false;
  // A worker that has been replaced may still send messages.
  const started: Port = spawn(
    (reply) => {
      if ("ready" in reply) ready = true;
      else if (port === started && active) receive(active, reply);
    },
    (cause) => {
      if (port !== started) return;
      port = undefined;
      const error = ready ? terminated(cause) : loadError("could not start the worker", cause);
      if (active) finish(active, { error });
    },
  );
  return started;
}

function receive(job: Job, reply: Exclude<Reply, { ready: true }>): void {
  if ("result" in reply) finish(job, { result: reply.result });
  else if ("error" in reply) finish(job, { error: new StitchError(reply.error) });
  else {
    try {
      job.onProgress?.(reply.progress);
    } catch (error) {
      finish(job, { error });
    }
  }
}

/** The error of a call whose worker terminated. */
function terminated(cause: Error): StitchError {
  const code =
    "code" in cause && cause.code === "ERR_WORKER_OUT_OF_MEMORY" ? "out-of-memory" : "internal";
  const message = `the worker terminated unexpectedly: ${cause.message}`;
  return new StitchError({ code, stage: "input", message, details: {} }, { cause });
}

function rest(): void {
  port?.busy(false);
  idle = setTimeout(stop, IDLE_MS);
  // In Node a pending timer would keep the process alive; in browsers it is a number.
  if (typeof idle === "object") idle.unref();
}

function stop(): void {
  const stopped = port;
  // Forgotten first: in Deno a worker reports its end before `terminate` returns, and this is not the end of a call.
  port = undefined;
  stopped?.terminate();
}
