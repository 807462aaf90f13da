import { isPixels, type Held, type Lodged, type Photo, type Pixels } from "./contents.js";
import { InputFileError } from "../input-file-error.js";
import type { Reply, Request, TaskName, Tasks } from "./tasks.js";

interface Waiting {
  resolve(value: unknown): void;
  reject(error: Error): void;
}

/** The arguments of a task, where arrays that the worker holds may stand for themselves. */
type Arguments<A extends readonly unknown[]> = {
  [K in keyof A]: A[K] extends Pixels ? A[K] | Held<A[K]> : A[K];
};

const waiting = new Map<number, Waiting>();
let worker: Worker | null = null;
let last = 0;

/** The worker lets go of what nobody here knows any more. */
const forgotten = new FinalizationRegistry<number>((held) => void imageTask("release", held));

/** Runs a task in the image worker. */
export function imageTask<N extends TaskName>(
  name: N,
  ...args: Arguments<Parameters<Tasks[N]>>
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  return post(name, args, []);
}

/** Gives an array away to the image worker. */
export async function hold<T extends Pixels>(value: T): Promise<Held<T>> {
  const handle = (await post("hold", [value], [value.data.buffer])) as Held<T>;
  forgotten.register(handle, handle.held);
  return handle;
}

/** A value with its large arrays given away to the image worker. */
export async function lodged<T extends object>(value: T): Promise<Lodged<T>> {
  const entries = Object.entries(value).map(async ([key, part]: [string, unknown]) => {
    return [key, isPixels(part) ? await hold(part) : part] as const;
  });
  return Object.fromEntries(await Promise.all(entries)) as Lodged<T>;
}

/** The array itself, to be given away: a copy, unless it can be made again. */
export function taken<T extends Pixels>(handle: Held<T>): Promise<T> {
  return post("take", [handle], []) as unknown as Promise<T>;
}

export async function decodePhoto(...args: Parameters<Tasks["decodePhoto"]>): Promise<Photo> {
  const photo = await imageTask("decodePhoto", ...args);
  forgotten.register(photo.pixels, photo.pixels.held);
  return photo;
}

function post<N extends TaskName>(
  name: N,
  args: readonly unknown[],
  transfer: readonly Transferable[],
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  return new Promise((resolve, reject) => {
    const id = ++last;
    waiting.set(id, { resolve: resolve as (value: unknown) => void, reject });
    worker ??= start();
    worker.postMessage({ id, name, args } satisfies Request, [...transfer]);
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
    // A worker that failed, for example for lack of memory, loses its tasks and what it held; the next task starts another one.
    worker = null;
    started.terminate();
    const error = new Error(event.message || "Part of this page could not be loaded.");
    for (const { reject } of waiting.values()) reject(error);
    waiting.clear();
  };
  return started;
}
