// The Web Worker of a page.
import { serve, type Message, type Reply } from "./serve.js";

/** The part of `DedicatedWorkerGlobalScope` used here; TypeScript's DOM library declares windows only. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Message>) => void) | null;
  postMessage(reply: Reply, transfer?: ArrayBuffer[]): void;
}

const scope = globalThis as unknown as WorkerScope;
scope.onmessage = ({ data }) =>
  void serve(data, (reply, transfer) => scope.postMessage(reply, transfer));
scope.postMessage({ ready: true });
