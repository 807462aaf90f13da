// The worker thread in Node.
import { parentPort } from "node:worker_threads";
import { serve, type Message, type Reply } from "./serve.js";

parentPort?.on(
  "message",
  (message: Message) =>
    void serve(message, (reply, transfer) => parentPort?.postMessage(reply, transfer)),
);
parentPort?.postMessage({ ready: true } satisfies Reply);
