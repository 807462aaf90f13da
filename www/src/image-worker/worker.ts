import type { Held } from "./contents.js";
import { InputFileError } from "../input-file-error.js";
import { endReading, read } from "./held.js";
import { tasks, type Reply, type Request } from "./tasks.js";
import { messageOf } from "../message-of.js";

/** The part of `DedicatedWorkerGlobalScope` used here; TypeScript's DOM library declares windows only. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Request>) => void) | null;
  postMessage(reply: Reply, transfer: Transferable[]): void;
}

const scope = globalThis as unknown as WorkerScope;
scope.onmessage = ({ data }) => void work(data);

async function work({ id, name, args }: Request): Promise<void> {
  // That which takes what is held is told what, the others what it is.
  const reading = name === "take" ? [] : args.filter(isHeld);
  try {
    const task = tasks[name] as (...args: readonly unknown[]) => unknown;
    const arrays = new Map(
      await Promise.all(reading.map(async (handle) => [handle, await read(handle)] as const)),
    );
    const value = await task(...args.map((arg) => arrays.get(arg as Held) ?? arg));
    scope.postMessage({ id, value }, transferables(value));
  } catch (error) {
    const message = messageOf(error);
    scope.postMessage({ id, message, unusable: error instanceof InputFileError }, []);
  } finally {
    reading.forEach(endReading);
  }
}

function isHeld(arg: unknown): arg is Held {
  return typeof arg === "object" && arg !== null && "held" in arg;
}

/** Buffers and bitmaps of a result, which are transferred. */
function transferables(value: unknown): Transferable[] {
  if (value instanceof ImageBitmap) return [value];
  if (ArrayBuffer.isView(value)) return value.buffer instanceof ArrayBuffer ? [value.buffer] : [];
  if (typeof value !== "object" || value === null || value instanceof Blob) return [];
  return Object.values(value).flatMap(transferables);
}
