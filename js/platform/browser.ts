import type { WasmSource } from "../types.js";
import type { Reply, Request } from "../worker/serve.js";

/** A running worker, seen from outside. */
export interface Port {
  post(request: Request, transfer: ArrayBuffer[]): void;
  /** Says whether there is work: an idle worker does not keep a Node program alive. */
  busy(yes: boolean): void;
  terminate(): void;
}

/** Starts a worker. `onDeath` hears of anything that ends it but `terminate`. */
export function spawn(onReply: (reply: Reply) => void, onDeath: (cause: Error) => void): Port {
  // Bundlers look for exactly this expression.
  const worker = new Worker(new URL("../worker/browser.js", import.meta.url), { type: "module" });
  worker.onmessage = ({ data }: MessageEvent<Reply>) => onReply(data);
  worker.onmessageerror = () => onDeath(new Error("a message could not be read"));
  worker.onerror = (event) => {
    event.preventDefault();
    onDeath(new Error(event.message || "the worker's script could not be loaded"));
  };
  return {
    post: (request, transfer) => worker.postMessage(request, transfer),
    busy: () => undefined,
    terminate: () => worker.terminate(),
  };
}

/** Compiles a wasm file. */
export async function compile(source: WasmSource): Promise<WebAssembly.Module> {
  if (typeof source !== "string" && !(source instanceof URL)) return WebAssembly.compile(source);
  const response = await fetch(source);
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  // Only what is served as wasm can be compiled while it arrives.
  const streams = response.headers.get("Content-Type")?.startsWith("application/wasm") === true;
  return streams
    ? WebAssembly.compileStreaming(response)
    : WebAssembly.compile(await response.arrayBuffer());
}

/** `fetch`, which in Node reads files, too. */
export const fetchFile = (address: string | URL, init: RequestInit): Promise<Response> =>
  fetch(address, init);
