import { isPixels } from "../image-worker/contents.js";
import type { NetworkName, NetworkProgress, NetworkReply, Requests } from "./requests.js";

/** A network could not be fetched or run. The message is for the user. */
export class NetworkError extends Error {
  override readonly name = "NetworkError";
}

/** The buffers of pictures among the arguments, which are given away. */
function buffersOf(args: object): Transferable[] {
  return Object.values(args)
    .filter(isPixels)
    .map(({ data }) => data.buffer);
}

/** Milliseconds after which an idle worker, which holds a network in memory, is terminated. */
const idleTime = 60_000;

let worker: Worker | null = null;
let idle = 0;

/**
 * Runs a network in a worker, which is started by the first call. Aborting terminates the worker, as a running network
 * cannot be interrupted. Only one call may run at a time. Pictures among the arguments are given away.
 */
export function runNetwork<N extends NetworkName>(
  name: N,
  args: Requests[N]["args"],
  signal: AbortSignal,
  onProgress: (progress: NetworkProgress) => void,
): Promise<Requests[N]["result"]> {
  return new Promise((resolve, reject) => {
    signal.throwIfAborted();
    clearTimeout(idle);
    const running = (worker ??= new Worker(new URL("./worker.ts", import.meta.url), {
      type: "module",
    }));
    const end = () => {
      running.terminate();
      worker = null;
    };
    const settle = (done: () => void) => {
      signal.removeEventListener("abort", onAbort);
      running.onmessage = running.onerror = null;
      idle = window.setTimeout(end, idleTime);
      done();
    };
    const onAbort = () =>
      settle(() => {
        end();
        reject(signal.reason);
      });
    signal.addEventListener("abort", onAbort);
    running.onmessage = ({ data }: MessageEvent<NetworkReply>) => {
      if ("progress" in data) onProgress(data.progress);
      else if ("result" in data) settle(() => resolve(data.result as Requests[N]["result"]));
      else settle(() => reject(new NetworkError(data.message)));
    };
    running.onerror = (event) => {
      event.preventDefault();
      settle(() => {
        end();
        reject(new NetworkError(event.message || "its script could not be loaded"));
      });
    };
    running.postMessage({ name, args }, buffersOf(args));
  });
}
