/** Where a network's weights are: an address, or the bytes themselves. */
export type Weights = string | URL | ArrayBuffer | Uint8Array;

/** How far a network's download or work has come. */
export interface ModelProgress {
  /** `download` of the weights, `prepare` of the network from them, `run` of the network. */
  stage: "download" | "prepare" | "run";
  /** How much of the stage is done, 0 to 1; 0 while a download's size is unknown. */
  fraction: number;
  /** Bytes that have arrived; of a download only. */
  loaded?: number;
  /** Bytes of the whole download; 0 where the host does not tell. */
  total?: number;
}

/** How a call that loads or runs a network behaves. */
export interface ModelCallOptions {
  /** Called as the work goes on. An exception thrown here rejects the call. */
  onProgress?: ((progress: ModelProgress) => void) | undefined;
  /**
   * Ends a download at once. A network that is running on this thread cannot be stopped: the call rejects when it pauses,
   * and its result is dropped.
   */
  signal?: AbortSignal | undefined;
}

/** Where ONNX Runtime's own wasm is: a folder that ends with a slash, or its two files. */
export type WasmPaths = string | { mjs?: string | URL; wasm?: string | URL };

/** How ONNX Runtime is set up. It is one for the whole program: what is set first stays in force. */
export interface RuntimeOptions {
  /**
   * Where the runtime's own wasm is served from. By default where your bundler put it, or next to the runtime's script; no
   * other host is asked.
   */
  wasmPaths?: WasmPaths | undefined;
  /** Threads of the wasm backend (default 1). More need a page that is cross-origin isolated. */
  threads?: number | undefined;
}
