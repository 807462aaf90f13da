// Modules of Node are not imported but requested at run time, so that bundlers for browsers do not find them.
import type { WasmSource } from "../types.js";
import type { Reply } from "../worker/serve.js";
import { compile as compileFetched, fetchFile as fetchRemote, type Port } from "./browser.js";

/** Whether this is Node (20.16 or newer) rather than a browser or a renderer of Electron. */
export function isNode(): boolean {
  const { process } = globalThis as { process?: { getBuiltinModule?: unknown; type?: string } };
  return typeof process?.getBuiltinModule === "function" && process.type !== "renderer";
}

export function spawn(onReply: (reply: Reply) => void, onExit: (cause: Error) => void): Port {
  const { Worker } = globalThis.process.getBuiltinModule("node:worker_threads");
  // Not `new URL(…, import.meta.url)`, as bundlers would include the script.
  const base = import.meta.url;
  // Flags of the process such as --input-type or --test must not be passed on.
  const worker = new Worker(new URL("../worker/node.js", base), { execArgv: [] });
  worker.on("message", onReply);
  worker.on("messageerror", onExit);
  worker.on("error", onExit);
  worker.on("exit", (status) => onExit(new Error(`the worker ended with status ${status}`)));
  return {
    post: (message, transfer) => worker.postMessage(message, transfer),
    busy: (busy) => (busy ? worker.ref() : worker.unref()),
    terminate: () => void worker.terminate(),
  };
}

export function processors(): number {
  return globalThis.process.getBuiltinModule("node:os").availableParallelism();
}

export async function compile(source: WasmSource): Promise<WebAssembly.Module> {
  const isPath = (typeof source === "string" || source instanceof URL) && isFile(source);
  return compileFetched(isPath ? await readFile(new URL(source)) : source);
}

function isFile(address: string | URL): boolean {
  return /^file:/i.test(String(address));
}

export async function fetchFile(address: string | URL, init: RequestInit): Promise<Response> {
  if (!isFile(address)) return fetchRemote(address, init);
  return new Response(await readFile(new URL(address)));
}

async function readFile(url: URL): Promise<Uint8Array<ArrayBuffer>> {
  const files = globalThis.process.getBuiltinModule("node:fs/promises");
  return Uint8Array.from(await files.readFile(url));
}
