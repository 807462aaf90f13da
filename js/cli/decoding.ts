import { Worker } from "node:worker_threads";

import type { Decoder } from "../cases/case.js";
import { StitchError, type ErrorRecord } from "../errors.js";

/** A message to the thread. */
export interface Request {
  readonly name: keyof Decoder;
  readonly bytes: Uint8Array;
}
/** Its answers come in the order of the messages. */
export type Reply = { readonly value: unknown } | { readonly error: ErrorRecord };

/**
 * Calls `work` with a decoder on a thread of its own, which ends with it. So does its memory: that of a wasm module does not shrink, and would
 * stand beside the core's.
 */
export async function withDecoder<T>(work: (decoder: Decoder) => Promise<T>): Promise<T> {
  // Flags of the process such as --input-type must not be passed on.
  const thread = new Worker(new URL("./decoding-thread.js", import.meta.url), { execArgv: [] });
  const ended = new Promise<never>((_, reject) => {
    thread.once("error", reject);
    thread.once("exit", (code) => reject(new Error(`decoding ended with status ${code}`)));
  });
  ended.catch(() => undefined);
  const waiting: ((reply: Reply) => void)[] = [];
  thread.on("message", (reply: Reply) => waiting.shift()?.(reply));
  const ask = (name: keyof Decoder) => async (bytes: Uint8Array) => {
    const answer = new Promise<Reply>((resolve) => waiting.push(resolve));
    thread.postMessage({ name, bytes } satisfies Request);
    const reply = await Promise.race([answer, ended]);
    if ("error" in reply) throw new StitchError(reply.error);
    return reply.value as never;
  };
  try {
    return await work({ photo: ask("photo"), depth: ask("depth") });
  } finally {
    await thread.terminate();
  }
}
