// The worker thread in Node.
import { parentPort } from "node:worker_threads";
import { serve, type Reply, type Request } from "./serve.js";

parentPort?.on(
  "message",
  (request: Request) =>
    void serve(request, (reply, transfer) => parentPort?.postMessage(reply, transfer)),
);
parentPort?.postMessage({ ready: true } satisfies Reply);
