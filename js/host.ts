// One call at a time, in order: two concurrent ones would need twice the memory. Aborting a running call terminates the workers, as
// nothing else can stop wasm; the next call starts new ones.
import type { Call, Result } from "./calls.js";
import { moduleOf } from "./core.js";
import { abortError } from "./errors.js";
import { processors } from "./platform/index.js";
import * as pool from "./pool.js";
import type { CallOptions } from "./types.js";

/** Milliseconds after which idle workers are terminated, which releases their memory. */
const IDLE_MS = 10_000;
/** Most workers unless more are asked for. */
const MOST_WORKERS = 4;

/** How a call ended: a worker answered, or something was thrown while workers may still be busy. */
type Outcome = pool.Performed | { thrown: unknown };

interface Job {
  call: Call;
  compile: () => Promise<WebAssembly.Module>;
  workers: number;
  onProgress: CallOptions["onProgress"];
  settle: (outcome: Outcome) => void;
}

const queue: Job[] = [];
let active: Job | undefined;
let idle: ReturnType<typeof setTimeout> | undefined;

/** Runs the call in workers. The buffers in `call` are transferred. */
export function runInWorkers(
  call: Call,
  compile: () => Promise<WebAssembly.Module>,
  { onProgress, signal, workers = "auto" }: CallOptions,
): Promise<Result> {
  const most = workers === "auto" ? Math.min(processors(), MOST_WORKERS) : workers;
  return new Promise((resolve, reject) => {
    const onAbort = () => signal && finish(job, { thrown: abortError(signal) });
    const job: Job = {
      call,
      compile,
      workers: processors() > 1 ? most : 1,
      onProgress,
      settle(outcome) {
        signal?.removeEventListener("abort", onAbort);
        if ("result" in outcome) resolve(outcome.result);
        else reject("thrown" in outcome ? outcome.thrown : outcome.error);
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
  let outcome: Outcome;
  try {
    outcome = await work(job);
  } catch (thrown) {
    outcome = { thrown };
  }
  finish(job, outcome);
}

async function work(job: Job): Promise<pool.Performed> {
  const { call, workers } = job;
  const name = moduleOf(call);
  const module = await job.compile();
  // Whoever aborts meanwhile has ended the call, which must not begin.
  if (active !== job) throw new Error("the call has ended");
  pool.prepare(name, workers);
  return pool.perform({ name, module, call, others: workers - 1 }, (progress) => {
    if (active === job) job.onProgress?.(progress);
  });
}

/** Settles a call, running or queued, with its result or error. */
function finish(job: Job, outcome: Outcome): void {
  if (active === job) {
    active = undefined;
    if ("thrown" in outcome) pool.stop();
    else rest();
  } else {
    const position = queue.indexOf(job);
    if (position < 0) return;
    queue.splice(position, 1);
  }
  job.settle(outcome);
  void next();
}

function rest(): void {
  pool.rest();
  idle = setTimeout(pool.stop, IDLE_MS);
  // In Node a pending timer would keep the process alive; in browsers it is a number.
  if (typeof idle === "object") idle.unref();
}
