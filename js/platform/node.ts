import { readFile } from "node:fs/promises";
import { Worker } from "node:worker_threads";
import type { WasmSource } from "../types.js";
import type { Reply } from "../worker/serve.js";
import { compile as compileFetched, fetchFile as fetchRemote, type Port } from "./browser.js";

export type { Port } from "./browser.js";

export function spawn(onReply: (reply: Reply) => void, onExit: (cause: Error) => void): Port {
  // Flags of the process such as --input-type or --test must not be passed on.
  const worker = new Worker(new URL("../worker/node.js", import.meta.url), { execArgv: [] });
  worker.on("message", onReply);
  worker.on("messageerror", onExit);
  worker.on("error", onExit);
  worker.on("exit", (status) => onExit(new Error(`the worker ended with status ${status}`)));
  return {
    post: (request, transfer) => worker.postMessage(request, transfer),
    busy: (busy) => (busy ? worker.ref() : worker.unref()),
    terminate: () => void worker.terminate(),
  };
}

export async function compile(source: WasmSource): Promise<WebAssembly.Module> {
  const url = source instanceof URL ? source : undefined;
  return compileFetched(url?.protocol === "file:" ? Uint8Array.from(await readFile(url)) : source);
}

export async function fetchFile(address: string | URL, init: RequestInit): Promise<Response> {
  if (!/^file:/i.test(String(address))) return fetchRemote(address, init);
  return new Response(Uint8Array.from(await readFile(new URL(address))));
}
