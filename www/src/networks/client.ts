import type { NetworkName, NetworkProgress, NetworkReply, Requests } from "./requests.js";

/** A network that could not be fetched or run; the message is for the user. */
export class NetworkError extends Error {
  override readonly name = "NetworkError";
}

/** How long a worker with a network in its memory may wait for more to do, in milliseconds. */
const idleTime = 60_000;

let worker: Worker | null = null;
let idle = 0;

/**
 * Runs a network in a worker of its own, which is started by the first call. Aborting ends that worker: a network that
 * runs cannot be stopped otherwise. One call at a time.
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
        reject(new NetworkError(event.message || "its program could not be loaded"));
      });
    };
    running.postMessage({ name, args });
  });
}
