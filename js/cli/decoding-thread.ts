// Decodes files one after another: see `decoding.ts`.
import { parentPort } from "node:worker_threads";

import { decoder } from "../cases/case.js";
import { recordOf } from "../instance.js";
import { serialQueue } from "../models/queue.js";
import { buffersOf } from "../transfer.js";
import type { Reply, Request } from "./decoding.js";

const inTurn = serialQueue();
parentPort?.on("message", ({ name, bytes }: Request) => {
  const send = (reply: Reply) => parentPort?.postMessage(reply, [...buffersOf(reply)]);
  inTurn<unknown>(() => decoder[name](bytes)).then(
    (value) => send({ value }),
    (error: unknown) => send({ error: recordOf(error) }),
  );
});
