import { isPixels, type Held, type Lodged, type Photo, type Pixels } from "./contents.js";
import { InputFileError } from "../input-file-error.js";
import type { Reply, Request, TaskName, Tasks } from "./tasks.js";

interface Waiting {
  resolve(value: unknown): void;
  reject(error: unknown): void;
}

/** The arguments of a task, where arrays that the worker holds may stand for themselves. */
type Arguments<A extends readonly unknown[]> = {
  [K in keyof A]: A[K] extends Pixels ? A[K] | Held<A[K]> : A[K];
};

/** A worker and the tasks that it was given. */
class ImageWorker {
  readonly #worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  readonly #waiting = new Map<number, Waiting>();
  ended = false;

  constructor() {
    this.#worker.onmessage = ({ data }: MessageEvent<Reply>) => {
      const waiter = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if ("value" in data) waiter?.resolve(data.value);
      else
        waiter?.reject(data.unusable ? new InputFileError(data.message) : new Error(data.message));
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      // For lack of memory, for example.
      this.end(new Error(event.message || "Part of this page could not be loaded."));
    };
  }

  post<N extends TaskName>(
    name: N,
    args: readonly unknown[],
    transfer: readonly Transferable[] = [],
  ): Promise<Awaited<ReturnType<Tasks[N]>>> {
    return new Promise((resolve, reject) => {
      const id = ++last;
      this.#waiting.set(id, { resolve: resolve as (value: unknown) => void, reject });
      this.#worker.postMessage({ id, name, args } satisfies Request, [...transfer]);
    });
  }

  /** Ends the worker, which loses its tasks and what it held. */
  end(error: unknown): void {
    this.ended = true;
    this.#worker.terminate();
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
  }
}

let shared: ImageWorker | null = null;
let last = 0;

/** The worker lets go of what nobody here knows any more. */
const forgotten = new FinalizationRegistry<number>((held) => void imageTask("release", held));

/** Runs a task in the image worker. */
export function imageTask<N extends TaskName>(
  name: N,
  ...args: Arguments<Parameters<Tasks[N]>>
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  return post(name, args);
}

/** Runs a task in a worker of its own, which ends with it, and at once when the signal says so. */
export async function imageTaskAlone<N extends TaskName>(
  signal: AbortSignal,
  name: N,
  ...args: Parameters<Tasks[N]>
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  const alone = new ImageWorker();
  const end = () => alone.end(signal.reason);
  signal.addEventListener("abort", end);
  try {
    return await alone.post(name, args);
  } finally {
    signal.removeEventListener("abort", end);
    end();
  }
}

/** What makes arrays that are not there yet, by what stands for them. */
const makers = new WeakMap<object, () => Promise<Held>>();
/** The numbers of those that the image worker has never had. */
let lastLater = 0;

/** Stands for an array of these sides and `bytes` that is made when a task first needs it. */
export function later<T extends Pixels>(
  sides: Omit<T, "data">,
  bytes: number,
  make: () => Promise<Held<T>>,
): Held<T> {
  const handle: Held<T> = { ...sides, held: --lastLater, bytes };
  makers.set(handle, make);
  return handle;
}

/** An argument of a task, made if it is not there yet. */
function made(arg: unknown): unknown {
  return (typeof arg === "object" && arg !== null && makers.get(arg)?.()) || arg;
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
  return post("take", [handle]) as unknown as Promise<T>;
}

export async function decodePhoto(...args: Parameters<Tasks["decodePhoto"]>): Promise<Photo> {
  const photo = await imageTask("decodePhoto", ...args);
  forgotten.register(photo.pixels, photo.pixels.held);
  return photo;
}

/** Has the shared worker, which holds the pictures, do a task; after a failure another one is started. */
async function post<N extends TaskName>(
  name: N,
  args: readonly unknown[],
  transfer: readonly Transferable[] = [],
): Promise<Awaited<ReturnType<Tasks[N]>>> {
  const present = await Promise.all(args.map(made));
  if (!shared || shared.ended) shared = new ImageWorker();
  return shared.post(name, present, transfer);
}
