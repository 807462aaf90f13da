import { InputFileError } from "../input-file-error.js";
import type { Reply, Request, TaskName, Tasks } from "./tasks.js";

interface Waiting {
  resolve(value: unknown): void;
  reject(error: Error): void;
}

const waiting = new Map<number, Waiting>();
let worker: Worker | null = null;
let last = 0;

/** Runs a task in the image worker. */
export function imageTask<N extends TaskName>(
  name: N,
  ...args: Parameters<Tasks[N]>
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  return new Promise((resolve, reject) => {
    const id = ++last;
    waiting.set(id, { resolve: resolve as (value: unknown) => void, reject });
    worker ??= start();
    worker.postMessage({ id, name, args } satisfies Request);
  });
}

function start(): Worker {
  const started = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  started.onmessage = ({ data }: MessageEvent<Reply>) => {
    const waiter = waiting.get(data.id);
    waiting.delete(data.id);
    if ("value" in data) waiter?.resolve(data.value);
    else waiter?.reject(data.unusable ? new InputFileError(data.message) : new Error(data.message));
  };
  started.onerror = (event) => {
    event.preventDefault();
    // A worker that failed, for example for lack of memory, loses its tasks; the next task starts another one.
    worker = null;
    started.terminate();
    const error = new Error(event.message || "Part of this page could not be loaded.");
    for (const { reject } of waiting.values()) reject(error);
    waiting.clear();
  };
  return started;
}
