import { InputFileError } from "../input-file-error.js";
import { tasks, type Reply, type Request } from "./tasks.js";

/** The part of `DedicatedWorkerGlobalScope` used here; TypeScript's DOM library declares windows only. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Request>) => void) | null;
  postMessage(reply: Reply, transfer: Transferable[]): void;
}

const scope = globalThis as unknown as WorkerScope;
scope.onmessage = ({ data }) => void work(data);

async function work({ id, name, args }: Request): Promise<void> {
  try {
    const task = tasks[name] as (...args: readonly unknown[]) => unknown;
    const value = await task(...args);
    scope.postMessage({ id, value }, transferables(value));
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    scope.postMessage({ id, message, unusable: error instanceof InputFileError }, []);
  }
}

/** Buffers and bitmaps of a result, which are transferred. */
function transferables(value: unknown): Transferable[] {
  if (value instanceof ImageBitmap) return [value];
  if (ArrayBuffer.isView(value)) return value.buffer instanceof ArrayBuffer ? [value.buffer] : [];
  if (typeof value !== "object" || value === null || value instanceof Blob) return [];
  return Object.values(value).flatMap(transferables);
}
