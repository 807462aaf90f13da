// The worker threads. Each performs one call at a time; calls, and tasks that a call leaves to others, wait until one is free.
import { spawn, type Port } from "./platform/index.js";
import type { Call, Result } from "./calls.js";
import type { ModuleName } from "./core.js";
import { isFatal, StitchError } from "./errors.js";
import { loadError } from "./load.js";
import { buffersOf } from "./transfer.js";
import type { Progress } from "./types.js";
import type { Reply, Request } from "./worker/serve.js";

/** What comes back from a worker: the result, or the error with which the core refused the call. */
export type Performed = { result: Result } | { error: StitchError };

interface Task {
  request: Request;
  onProgress: (progress: Progress) => void;
  resolve: (performed: Performed) => void;
  reject: (error: unknown) => void;
}

interface Thread {
  port: Port;
  task: Task | undefined;
  /** Bytes of its module's memory. */
  memory: number;
}

/** Bytes of memory up to which a thread is kept for the next call: about what a stitch of 1 MP takes. */
const MOST_KEPT = 2 ** 26;

const waiting: Task[] = [];
const threads: Thread[] = [];
/** How many threads there may be. */
let most = 1;
/** The module that the threads have instantiated, whose memory does not shrink: another one gets new threads. */
let loaded: ModuleName | undefined;

/** Says what the next calls need. */
export function prepare(module: ModuleName, workers: number): void {
  if (loaded !== module) stop();
  loaded = module;
  most = workers;
}

/**
 * Performs a call in a worker, to which its buffers are transferred.
 *
 * @throws {StitchError} if the worker cannot be started or ends, or the core fails; what `onProgress` throws.
 */
export function perform(
  request: Request,
  onProgress: (progress: Progress) => void,
): Promise<Performed> {
  // The memory of others makes room, but for one that may go on.
  endLarge(1);
  return enqueue(request, onProgress);
}

function enqueue(request: Request, onProgress: Task["onProgress"]): Promise<Performed> {
  return new Promise((resolve, reject) => {
    waiting.push({ request, onProgress, resolve, reject });
    assign();
  });
}

/** Has a thread perform a task of the call that another one performs, which fails if the task does. */
async function performTask(owner: Thread, number: number, call: Call): Promise<void> {
  const { task: whole, port } = owner;
  if (!whole) return;
  try {
    const performed = await enqueue({ ...whole.request, call, others: 0 }, () => undefined);
    if ("error" in performed) throw performed.error;
    const { result } = performed;
    if (threads.includes(owner)) port.post({ task: number, result }, [...buffersOf(result)]);
    // Tasks of another stage may follow, but not soon.
    if (waiting.length === 0) endLarge(0);
  } catch (error) {
    whole.reject(error);
  }
}

/** Lets threads be: in Node they do not keep the process alive. Those with much memory, which does not shrink, end. */
export function rest(): void {
  endLarge(0);
  for (const { port } of threads) port.busy(false);
}

/** Ends all threads; calls that run or wait never settle. */
export function stop(): void {
  waiting.length = 0;
  for (const thread of [...threads]) end(thread);
}

/** Ends idle threads with much memory, except so many. */
function endLarge(kept: number): void {
  const large = threads.filter(({ task, memory }) => !task && memory > MOST_KEPT);
  for (const thread of large.slice(kept)) end(thread);
}

function end(thread: Thread): void {
  // Forgotten first: in Deno a worker reports its end before `terminate` returns, and this is not the end of a call.
  threads.splice(threads.indexOf(thread), 1);
  thread.port.terminate();
}

/** Gives calls that wait to threads that are free. */
function assign(): void {
  while (waiting.length > 0) {
    const free = threads.find(({ task }) => !task);
    if (!free && threads.length >= most) return;
    const task = waiting.shift();
    if (!task) return;
    try {
      const thread = free ?? start();
      thread.task = task;
      thread.port.busy(true);
      thread.port.post(task.request, [...buffersOf(task.request.call.args)]);
    } catch (cause) {
      task.reject(loadError("could not start the worker", cause));
    }
  }
}

function start(): Thread {
  let ready = false;
  const port = spawn(
    (reply) => {
      if ("ready" in reply) ready = true;
      else receive(thread, reply);
    },
    (cause) => {
      const at = threads.indexOf(thread);
      if (at < 0) return;
      threads.splice(at, 1);
      // In browsers a worker survives an error of its own.
      port.terminate();
      thread.task?.reject(
        ready ? terminated(cause) : loadError("could not start the worker", cause),
      );
    },
  );
  const thread: Thread = { port, task: undefined, memory: 0 };
  threads.push(thread);
  return thread;
}

function receive(thread: Thread, reply: Exclude<Reply, { ready: true }>): void {
  const { task } = thread;
  // A thread that was stopped may still send messages.
  if (!task || !threads.includes(thread)) return;
  if ("progress" in reply) {
    try {
      task.onProgress(reply.progress);
    } catch (error) {
      task.reject(error);
    }
    return;
  }
  if ("task" in reply) {
    void performTask(thread, reply.task, reply.call);
    return;
  }
  thread.task = undefined;
  thread.memory = reply.memory;
  if ("result" in reply) {
    task.resolve(reply);
  } else {
    const error = new StitchError(reply.error);
    if (isFatal(error)) task.reject(error);
    else task.resolve({ error });
  }
  assign();
}

/** The error of a call whose worker terminated. */
function terminated(cause: Error): StitchError {
  const code =
    "code" in cause && cause.code === "ERR_WORKER_OUT_OF_MEMORY" ? "out-of-memory" : "internal";
  const message = `the worker terminated unexpectedly: ${cause.message}`;
  return new StitchError({ code, stage: "input", message, details: {} }, { cause });
}
