import { readFile } from "node:fs/promises";
import { Worker } from "node:worker_threads";
import type { WasmSource } from "../types.js";
import type { Reply } from "../worker/serve.js";
import { compile as compileFetched, fetchFile as fetchRemote, type Port } from "./browser.js";

export type { Port } from "./browser.js";

export function spawn(onReply: (reply: Reply) => void, onDeath: (cause: Error) => void): Port {
  // The program's own flags (--input-type, --test …) are not for the worker.
  const worker = new Worker(new URL("../worker/node.js", import.meta.url), { execArgv: [] });
  worker.on("message", onReply);
  worker.on("messageerror", onDeath);
  worker.on("error", onDeath);
  worker.on("exit", (status) => onDeath(new Error(`the worker ended with status ${status}`)));
  return {
    post: (request, transfer) => worker.postMessage(request, transfer),
    busy: (yes) => (yes ? worker.ref() : worker.unref()),
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
