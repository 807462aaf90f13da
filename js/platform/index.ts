// Chooses the platform at run time. All imports are relative, so the package also works in browsers without a bundler.
import * as browser from "./browser.js";
import * as node from "./node.js";
import type { WasmSource } from "../types.js";
import type { Reply } from "../worker/serve.js";
import type { Port } from "./browser.js";

export type { Port } from "./browser.js";

function platform(): typeof browser {
  return node.isNode() ? node : browser;
}

/** Starts a worker. `onExit` is called when it ends other than by `terminate`. */
export function spawn(onReply: (reply: Reply) => void, onExit: (cause: Error) => void): Port {
  return platform().spawn(onReply, onExit);
}

/** How many processors there are; 1 where that is not known. */
export function processors(): number {
  return platform().processors();
}

/** Compiles a wasm file. */
export function compile(source: WasmSource): Promise<WebAssembly.Module> {
  return platform().compile(source);
}

/** `fetch`, which in Node also reads `file:` URLs. */
export function fetchFile(address: string | URL, init: RequestInit): Promise<Response> {
  return platform().fetchFile(address, init);
}
