import type { WasmSource } from "../types.js";
import type { Message, Reply } from "../worker/serve.js";

/** A running worker. */
export interface Port {
  post(message: Message, transfer: ArrayBuffer[]): void;
  /** Whether the worker has work. An idle worker does not keep a Node process alive. */
  busy(busy: boolean): void;
  terminate(): void;
}

/** Starts a worker. `onExit` is called when it ends other than by `terminate`. */
export function spawn(onReply: (reply: Reply) => void, onExit: (cause: Error) => void): Port {
  // Bundlers recognize exactly the second expression.
  const worker =
    workerOfAnotherOrigin() ??
    new Worker(new URL("../worker/browser.js", import.meta.url), { type: "module" });
  worker.onmessage = ({ data }: MessageEvent<Reply>) => onReply(data);
  worker.onmessageerror = () => onExit(new Error("a message could not be read"));
  worker.onerror = (event) => {
    event.preventDefault();
    onExit(new Error(event.message || "the worker's script could not be loaded"));
  };
  return {
    post: (message, transfer) => worker.postMessage(message, transfer),
    busy: () => undefined,
    terminate: () => worker.terminate(),
  };
}

/**
 * The worker when this script comes from another origin than the page, a CDN say: browsers start workers of the page's origin
 * only, but these may import from anywhere.
 */
function workerOfAnotherOrigin(): Worker | undefined {
  // Not `new URL(…, import.meta.url)`, as bundlers would include the script again; and some put a file's address there.
  const base = import.meta.url;
  if (!/^https?:/.test(base) || new URL(base).origin === globalThis.location?.origin) return;
  const address = JSON.stringify(new URL("../worker/browser.js", base).href);
  const script = URL.createObjectURL(new Blob([`import ${address};`], { type: "text/javascript" }));
  const worker = new Worker(script, { type: "module" });
  // Once it has run, or could not be loaded, its address is of no use any more.
  for (const event of ["message", "error"] as const) {
    worker.addEventListener(event, () => URL.revokeObjectURL(script), { once: true });
  }
  return worker;
}

/** How many processors there are; 1 where that is not known. */
export function processors(): number {
  return globalThis.navigator?.hardwareConcurrency ?? 1;
}

/** Compiles a wasm file. */
export async function compile(source: WasmSource): Promise<WebAssembly.Module> {
  if (typeof source !== "string" && !(source instanceof URL)) return WebAssembly.compile(source);
  const response = await fetch(source);
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  // Streaming compilation requires the MIME type of wasm.
  const streams = response.headers.get("Content-Type")?.startsWith("application/wasm") === true;
  return streams
    ? WebAssembly.compileStreaming(response)
    : WebAssembly.compile(await response.arrayBuffer());
}

/** `fetch`, which in Node also reads `file:` URLs. */
export const fetchFile = (address: string | URL, init: RequestInit): Promise<Response> =>
  fetch(address, init);
